// SPDX-License-Identifier: Apache-2.0
// striper compare: scans against those of another scanner, or against themselves.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/compare/centroid_repeatability.hpp>
#include <striper/compare/scan_comparison.hpp>
#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/scans/open_scans.hpp>

#include "options/option_bounds.hpp"
#include "options/range_sigmas.hpp"
#include "program/plot_file.hpp"
#include "program/program.hpp"
#include "program/svg_chart.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct CompareArguments {
  std::string scans;
  std::optional<std::string> reference;
  std::optional<std::string> model;
  int frames = 50;
  double sigma_m = kNoSigma_m;
  bool repeat = false;
  bool reference_offset = false;
  double reference_quantum_m = 0.0;
  std::optional<std::string> plot;
  bool json = false;
};

constexpr const char* kDescription =
    "Compare scans with another scanner's, or with themselves (--repeat).";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper compare scans.csv sick.csv --reference-offset --reference-quantum 0.01\n"
    "      where the other scanner stands, and how the ranges differ; it rounds to 1 cm\n"
    "  striper compare scans.csv sick.csv --plot compare.svg\n"
    "  striper compare --repeat scans.csv     how much a still scene's ranges change\n"
    "  striper compare --repeat v4l2:/dev/video0 --model striper.yaml --frames 100\n\n"
    "Scans are a recording (CONVENTIONS.md), or what a source gives with --model; of a CSV only "
    "frame,\n"
    "time_s, bearing_rad and range_m must be there; where either has no sigma_m say --sigma, or\n"
    "how the reference rounds; --repeat needs the pixels. The reference's first scan is taken. It "
    "may\n"
    "stand 0.6 m and 20 degrees away.\n"
    "Exit code 3 where what both see does not determine that.";

void define(Command& command, CompareArguments& arguments) {
  command
      .add_option("SCANS", arguments.scans,
                  "Scans of the striper: a recording, or a source and --model")
      ->required();
  auto* const reference = command.add_option("REFERENCE", arguments.reference,
                                             "A scan of another scanner, a recording");
  command.add_option("--model", arguments.model, "Of the striper, for a source of frames")
      ->type_name("FILE");
  command.add_option("--frames", arguments.frames, "How many scans of a source that does not end")
      ->type_name("N")
      ->check(above_zero());
  auto* const repeat =
      command.add_flag("--repeat", arguments.repeat, "Compare each scan with the next")
          ->excludes(reference);
  add_sigma_option(command, arguments.sigma_m)->excludes(repeat);
  command
      .add_flag("--reference-offset", arguments.reference_offset,
                "The reference's ranges may all be off by the same amount: estimate it")
      ->excludes(repeat);
  command
      .add_option("--reference-quantum", arguments.reference_quantum_m,
                  "The step in which the reference rounds its ranges, metres")
      ->type_name("M")
      ->check(between(0.0, 1.0))
      ->excludes(repeat);
  command.add_option("--plot", arguments.plot, "Both from above, and the differences")
      ->type_name("FILE.svg")
      ->excludes("--repeat");
  command.add_flag("--json", arguments.json, "For programs, on the standard output");
  command.footer(kExamples);
}

// All of a recording, or so many of what does not end.
std::vector<PolarScan> read_scans(const std::string& uri, const CompareArguments& arguments) {
  const TerminalEvents events;
  std::shared_ptr<const StriperModel> model;
  if (arguments.model) model = std::make_shared<StriperModel>(load_model(*arguments.model));
  const auto source = open_scans(uri, model, std::nullopt, events.port());
  const std::size_t most = source->info().source.is_live
                               ? static_cast<std::size_t>(arguments.frames)
                               : std::numeric_limits<std::size_t>::max();
  std::vector<PolarScan> scans;
  PolarScan scan;
  while (scans.size() < most && !stop_requested()) {
    const NextStatus status = source->next(scan, std::chrono::milliseconds(100));
    if (status == NextStatus::kTimeout) continue;
    if (status != NextStatus::kFrame) break;
    scans.push_back(scan);
  }
  if (stop_requested() && scans.size() < 2) throw Error(ErrorKind::kDevice, "interrupted");
  if (scans.empty()) throw Error(ErrorKind::kBadFile, fmt::format("{} has no scans", uri));
  return scans;
}

nlohmann::json bins_json(const std::vector<ComparisonBin>& bins, const char* from, const char* to,
                         double unit) {
  nlohmann::json json = nlohmann::json::array();
  for (const ComparisonBin& bin : bins)
    json.push_back({{from, bin.from / unit},
                    {to, bin.to / unit},
                    {"count", bin.count},
                    {"median_m", bin.median_m},
                    {"sigma_m", bin.sigma_m}});
  return json;
}

nlohmann::json to_json(const ScanComparison& found) {
  const PlanarPose& pose = found.pose;
  nlohmann::json json;
  json["pose"] = {{"x_m", pose.x_m},
                  {"y_m", pose.y_m},
                  {"yaw_deg", pose.yaw_rad / kDegree},
                  {"sigma_x_m", pose.sigma_x_m},
                  {"sigma_y_m", pose.sigma_y_m},
                  {"sigma_yaw_deg", pose.sigma_yaw_rad / kDegree}};
  json["reference_offset_m"] = nullptr;
  json["sigma_offset_m"] = nullptr;
  if (found.reference_offset_m) json["reference_offset_m"] = *found.reference_offset_m;
  if (found.sigma_offset_m) json["sigma_offset_m"] = *found.sigma_offset_m;
  json["pairs"] = found.pairs.size();
  json["dropped"] = {{"not_visible", found.dropped.not_visible},
                     {"no_segment", found.dropped.no_segment},
                     {"status", found.dropped.status}};
  json["pull_mean"] = found.pull_mean;
  json["pull_sd"] = found.pull_sd;
  json["inside_1_96"] = found.inside_1_96;
  json["expected_inside_1_96"] = found.expected_inside_1_96;
  json["bias_by_bearing"] = bins_json(found.bias_by_bearing, "from_deg", "to_deg", kDegree);
  json["bias_by_range"] = bins_json(found.bias_by_range, "from_m", "to_m", 1.0);
  json["outliers"] = nlohmann::json::object();
  for (const StatusOutliers& one : found.outliers)
    json["outliers"][std::string(to_string(one.status))] = {{"compared", one.compared},
                                                            {"outliers", one.outliers}};
  return json;
}

std::string text_of(const ScanComparison& found) {
  const PlanarPose& pose = found.pose;
  std::string text = fmt::format(
      "the reference stands at x {:.4f} +- {:.4f} m, y {:.4f} +- {:.4f} m, turned by {:.3f} +- "
      "{:.3f} degrees\n",
      pose.x_m, pose.sigma_x_m, pose.y_m, pose.sigma_y_m, pose.yaw_rad / kDegree,
      pose.sigma_yaw_rad / kDegree);
  if (found.reference_offset_m)
    text += fmt::format("its ranges are too short by {:.1f} +- {:.1f} mm\n",
                        1e3 * *found.reference_offset_m, 1e3 * *found.sigma_offset_m);
  text += fmt::format(
      "{} returns compared; not compared: {} not visible to it, {} where it has no surface, {} by "
      "their status\n",
      found.pairs.size(), found.dropped.not_visible, found.dropped.no_segment,
      found.dropped.status);
  text += fmt::format(
      "pulls: mean {:.2f}, deviation {:.2f}; {:.1f} % within 1.96 sigma, the stated errors predict "
      "{:.1f} %\n",
      found.pull_mean, found.pull_sd, 100.0 * found.inside_1_96,
      100.0 * found.expected_inside_1_96);
  for (const StatusOutliers& one : found.outliers)
    text += fmt::format("{:14} {:6d} in view of it, {} more than 3 sigma off\n",
                        to_string(one.status), one.compared, one.outliers);
  text += "bearing (degrees)     returns  median (mm)\n";
  for (const ComparisonBin& bin : found.bias_by_bearing)
    text += fmt::format("  {:7.1f} to {:7.1f}   {:6d}  {:+8.1f} +- {:.1f}\n", bin.from / kDegree,
                        bin.to / kDegree, bin.count, 1e3 * bin.median_m, 1e3 * bin.sigma_m);
  return text;
}

Eigen::Vector2d point_of(const Return& one) {
  return one.range_m * Eigen::Vector2d(std::cos(one.bearing_rad), std::sin(one.bearing_rad));
}

// As one looks at a striper from above: forward is up, left is left.
Eigen::Vector2d from_above(const Eigen::Vector2d& point) { return {-point.y(), point.x()}; }

// As the paper's Figure 4: the striper's returns with their errors, and the other scanner's.
SvgChart plot_of(const PolarScan& scan, const PolarScan& reference, const PlanarPose& pose) {
  std::vector<Eigen::Vector2d> ours, theirs, near, far;
  double reach_m = 0.0;
  for (const Return& one : scan.returns) {
    if (one.status != ReturnStatus::kOk || !std::isfinite(one.range_m)) continue;
    const Eigen::Vector2d point = point_of(one);
    ours.push_back(from_above(point));
    near.push_back(from_above(point * (one.range_near_m / one.range_m)));
    far.push_back(from_above(point * (one.range_far_m / one.range_m)));
    reach_m = std::max(reach_m, one.range_m);
  }
  for (const Return& one : reference.returns)
    if (one.status == ReturnStatus::kOk && std::isfinite(one.range_m))
      theirs.push_back(from_above(pose * point_of(one)));
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  Eigen::Vector2d high = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : ours) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const double margin_m = 0.08 * reach_m;
  SvgChart chart("Seen from above", {"to the right (m)", low.x() - margin_m, high.x() + margin_m},
                 {"forward (m)", low.y() - margin_m, high.y() + margin_m}, true);
  chart.bars("half a pixel nearer and farther", "#f0a030", near, far);
  chart.dots("striper", "#12395c", 1.2, ours);
  chart.dots("reference", "#111111", 1.8, theirs);
  return chart;
}

SvgChart differences_of(const ScanComparison& found) {
  std::vector<Eigen::Vector2d> dots;
  double most = 5.0;
  for (const ComparedReturn& pair : found.pairs) {
    dots.emplace_back(pair.bearing_rad / kDegree, 1e3 * pair.difference_m);
    most = std::max(most, std::abs(1e3 * pair.difference_m));
  }
  std::vector<Eigen::Vector2d> middle;
  for (const ComparisonBin& bin : found.bias_by_bearing)
    middle.emplace_back(0.5 * (bin.from + bin.to) / kDegree, 1e3 * bin.median_m);
  const double from = found.bias_by_bearing.front().from / kDegree;
  const double to = found.bias_by_bearing.back().to / kDegree;
  SvgChart chart("Range less the reference's", {"bearing (degrees)", from, to},
                 {"mm", -1.05 * most, 1.05 * most});
  chart.dots("return", "#8aa4bf", 1.4, dots);
  chart.line("median", "#c2410c", middle);
  return chart;
}

// The first scan, with sigmas unless it rounds, which then is its error.
PolarScan read_reference(const CompareArguments& arguments) {
  PolarScan reference = read_scans(*arguments.reference, arguments).front();
  RangeSigmas sigmas(arguments.sigma_m);
  sigmas.complete(reference);
  if (!(arguments.reference_quantum_m > 0.0))
    sigmas.require_any(*arguments.reference, ", or how they are rounded by --reference-quantum M");
  return reference;
}

ExitCode compare_with_reference(const CompareArguments& arguments) {
  require_plot_file("--plot", arguments.plot);
  std::vector<PolarScan> scans = read_scans(arguments.scans, arguments);
  RangeSigmas sigmas(arguments.sigma_m);
  for (PolarScan& scan : scans) sigmas.complete(scan);
  sigmas.require_any(arguments.scans);
  const PolarScan reference = read_reference(arguments);
  CompareOptions options;
  options.reference_offset = arguments.reference_offset;
  options.reference_quantum_m = arguments.reference_quantum_m;
  const ScanComparison found = compare_scans(scans, reference, options);
  if (arguments.plot)
    write_plot_file(*arguments.plot,
                    svg_of({plot_of(scans.front(), reference, found.pose), differences_of(found)}));
  if (arguments.json)
    print_json(to_json(found));
  else
    fmt::print("{}", text_of(found));
  return ExitCode::kDone;
}

constexpr double kPapersChange_px = 0.3;
constexpr std::array kStripeSigmas_px{0.7, 1.2, 2.0};

// At which ratio of signal to noise a three-pixel centroid changes as much as the paper's.
nlohmann::json centroid_snrs() {
  nlohmann::json json = nlohmann::json::array();
  for (const double sigma_px : kStripeSigmas_px)
    json.push_back({{"sigma_px", sigma_px}, {"snr", centroid_snr(sigma_px, kPapersChange_px)}});
  return json;
}

ExitCode compare_repeats(const CompareArguments& arguments) {
  const ScanRepeatability found = repeatability(read_scans(arguments.scans, arguments));
  if (arguments.json)
    print_json({{"mean_change_px", found.mean_change_px},
                {"mean_change_m", found.mean_change_m},
                {"mean_pixel_m", found.mean_pixel_m},
                {"ratio", found.ratio},
                {"changes", found.changes},
                {"centroid_snr_at_0_3", centroid_snrs()}});
  else
    fmt::print(
        "from scan to scan a range changes by {:.2f} mm on average, {:.3f} of a pixel ({:.2f} "
        "mm); {} changes\n",
        1e3 * found.mean_change_m, found.ratio, 1e3 * found.mean_pixel_m, found.changes);
  if (!arguments.json)
    for (const double sigma_px : kStripeSigmas_px)
      fmt::print(
          "the paper's 0.3: a three-pixel centroid of a stripe of sigma {:.1f} px at SNR "
          "{:.0f}\n",
          sigma_px, centroid_snr(sigma_px, kPapersChange_px));
  return ExitCode::kDone;
}

ExitCode run_compare(const CompareArguments& arguments) {
  if (arguments.repeat) return compare_repeats(arguments);
  if (!arguments.reference)
    throw Error(ErrorKind::kUsage,
                "give a REFERENCE, or --repeat to compare scans with themselves");
  return compare_with_reference(arguments);
}

}  // namespace

void add_compare(Command& striper, Action& action) {
  add_command<CompareArguments>(striper, action, "compare", kDescription, define, run_compare);
}

}  // namespace striper::program
