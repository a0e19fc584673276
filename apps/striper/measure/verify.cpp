// SPDX-License-Identifier: Apache-2.0
// striper verify: scans a flat target and holds what is measured against what the model promises.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>
#include <striper/geometry/line_fit.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/profile/tools.hpp>

#include "measure/verify_sheet.hpp"
#include "options/scanner_arguments.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/frame_loop.hpp"
#include "run/stripe_watch.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct VerifyArguments {
  std::string source;
  ScannerArguments scanner;
  FrameLimits limits;
  std::optional<double> distance_m;
  double least_fill = 0.9;
  double most_ratio = 2.0;
  std::vector<std::string> at;
  std::optional<double> step_m;
  std::optional<double> radius_m;
  bool json = false;
};

constexpr const char* kDescription =
    "Check a striper on a flat target: flatness against the error bars, fill, temporal noise, "
    "bias.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper verify v4l2:/dev/video0 --model striper.yaml --frames 50\n"
    "      a flat wall across the whole field of view\n"
    "  striper verify images:wall --model striper.yaml --distance 1.500\n"
    "      the wall is 1.500 m from the scan origin, measured square to it\n"
    "  striper verify images:a --model striper.yaml --distance 1 --at 1.5=images:b --at "
    "2=images:c\n"
    "      and how straight measured distances run along with known ones\n"
    "  striper verify images:block --model striper.yaml --step 0.020\n\n"
    "A sheet as of a laser profiler comes first: clearance, measuring range and field of view (of\n"
    "the model), spacing, z resolution, repeatability of the mean, rate, latency, with counts.\n"
    "Flatness: rms of the returns about a straight line, and the same over each return's own\n"
    "sigma (1 where the error bars are right). Temporal noise: mean change of a column's stripe\n"
    "between successive scans, px. Exit code 0 passed, 1 failed.";

// One straight line through a scan's good returns, in 1/range, where it is linear and the noise
// Gaussian; twice with the worst taken out.
struct FlatScan {
  int good = 0;
  int lines = 0;
  double squares_m2 = 0.0;
  double squares_sigmas = 0.0;
  int used = 0;
  double distance_m = NAN;  // Of the line from the scan origin.
  double sigma_cal_m = NAN;
};

// cos(bearing) p0 + sin(bearing) p1 = 1/range.
LineFit fit(const std::vector<const Return*>& returns) {
  LineSums sums;
  for (const Return* r : returns) {
    const double q2 = 1.0 / (r->range_m * r->range_m);
    sums.add(std::cos(r->bearing_rad), std::sin(r->bearing_rad), 1.0 / r->range_m,
             1.0 / (r->sigma_m * r->sigma_m * q2 * q2));
  }
  return sums.solve();
}

// Distance from the line along the return's own ray.
double along_ray_m(const LineFit& line, const Return& r) {
  return r.range_m - 1.0 / line.at(std::cos(r.bearing_rad), std::sin(r.bearing_rad));
}

FlatScan check(const PolarScan& scan) {
  FlatScan flat;
  flat.lines = static_cast<int>(scan.returns.size());
  std::vector<const Return*> good;
  for (const Return& r : scan.returns)
    if (r.status == ReturnStatus::kOk && std::isfinite(r.range_m) && r.sigma_m > 0.0)
      good.push_back(&r);
  flat.good = static_cast<int>(good.size());
  if (good.size() < 10) return flat;
  LineFit line = fit(good);
  for (int round = 0; round < 2; ++round) {
    std::vector<double> errors;
    errors.reserve(good.size());
    for (const Return* r : good) errors.push_back(std::abs(along_ray_m(line, *r)) / r->sigma_m);
    std::vector<double> sorted = errors;
    const double gate = 5.0 * kSigmaOfMedianAbsolute * std::max(upper_median(sorted), 1e-3);
    std::vector<const Return*> kept;
    for (std::size_t i = 0; i < good.size(); ++i)
      if (errors[i] <= gate) kept.push_back(good[i]);
    if (kept.size() < 10) break;
    good = kept;
    line = fit(good);
  }
  flat.used = static_cast<int>(good.size());
  flat.distance_m = 1.0 / line.parameters.norm();
  flat.sigma_cal_m = good[good.size() / 2]->sigma_cal_m;
  for (const Return* r : good) {
    const double e = along_ray_m(line, *r);
    flat.squares_m2 += e * e;
    flat.squares_sigmas += std::pow(e / r->sigma_m, 2.0);
  }
  return flat;
}

class Verification {
 public:
  void add(const PolarScan& scan) {
    const FlatScan flat = check(scan);
    ++scans_;
    lines_ += flat.lines;
    good_ += flat.good;
    used_ += flat.used;
    squares_m2_ += flat.squares_m2;
    squares_sigmas_ += flat.squares_sigmas;
    if (std::isfinite(flat.distance_m)) distances_m_.push_back(flat.distance_m);
    sigma_cal_m_ = flat.sigma_cal_m;
    compare_with_last(scan);
  }

  nlohmann::json result(const VerifyArguments& arguments) const {
    nlohmann::json json;
    json["scans"] = scans_;
    json["fill"] = fill();
    json["flatness_rms_m"] = flatness_m();
    json["flatness_over_sigma"] = ratio();
    json["temporal_px"] = temporal_px();
    json["distance_m"] = mean_distance_m();
    if (arguments.distance_m) {
      json["bias_m"] = mean_distance_m() - *arguments.distance_m;
      json["sigma_cal_m"] = sigma_cal_m_;
    }
    return json;
  }

  const std::vector<double>& distances_m() const noexcept { return distances_m_; }
  double mean_distance_m() const {
    double sum = 0.0;
    for (const double d : distances_m_) sum += d;
    return distances_m_.empty() ? NAN : sum / static_cast<double>(distances_m_.size());
  }

  void say_result(const VerifyArguments& arguments) const {
    say(fmt::format("{} scans of a flat target at {:.4f} m (square to it)", scans_,
                    mean_distance_m()));
    say(fmt::format("fill: {:.1f} % of the scan lines have a return", 100.0 * fill()));
    say(fmt::format("flatness: {:.3f} mm rms, {:.2f} times what the error bars say",
                    1e3 * flatness_m(), ratio()));
    if (changes_ > 0)
      say(fmt::format("temporal noise: {:.3f} px mean change from scan to scan", temporal_px()));
    if (arguments.distance_m) say_bias(mean_distance_m() - *arguments.distance_m);
  }

  std::string failures(const VerifyArguments& arguments) const {
    if (used_ == 0) return "no flat target was seen";
    std::string text;
    const auto add = [&](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
    if (fill() < arguments.least_fill)
      add(fmt::format("fill {:.2f} is below {:.2f} (--min-fill)", fill(), arguments.least_fill));
    if (ratio() > arguments.most_ratio)
      add(
          fmt::format("the scatter is {:.2f} times the error bars, above {:.2f} (--max-ratio): the "
                      "target is not flat, or the lens or the noise is not the model's",
                      ratio(), arguments.most_ratio));
    if (!arguments.distance_m) return text;
    const double bias_m = std::abs(mean_distance_m() - *arguments.distance_m);
    const double known_m = std::isfinite(sigma_cal_m_) ? sigma_cal_m_ : 0.0;
    // What a still scene's errors have in common with those of the next scan is not averaged out.
    const double of_scan = static_cast<double>(used_) / std::max(scans_, 1);
    if (bias_m > 3.0 * known_m + 3.0 * flatness_m() / std::sqrt(of_scan) + 1e-6)
      add(fmt::format("the bias of {:.2f} mm is beyond {}", 1e3 * bias_m,
                      known_m > 0.0 ? "three sigmas of the calibration"
                                    : "the scatter, which is all that a model without covariance "
                                      "leaves to hold it against"));
    return text;
  }

 private:
  void say_bias(double bias_m) const {
    const std::string sigma = std::isfinite(sigma_cal_m_)
                                  ? fmt::format("{:.3f} mm", 1e3 * sigma_cal_m_)
                                  : "not known, the model has no covariance";
    say(fmt::format("bias: {:+.3f} mm (calibration error, one sigma: {})", 1e3 * bias_m, sigma));
  }
  double fill() const { return lines_ > 0 ? static_cast<double>(good_) / lines_ : 0.0; }
  double flatness_m() const { return used_ > 0 ? std::sqrt(squares_m2_ / used_) : NAN; }
  double ratio() const { return used_ > 0 ? std::sqrt(squares_sigmas_ / used_) : NAN; }
  double temporal_px() const { return changes_ > 0 ? change_px_ / changes_ : NAN; }

  // The paper's figure: how far the stripe of a column moves between two scans of a still target.
  void compare_with_last(const PolarScan& scan) {
    std::vector<double>& last = last_px_[static_cast<int>(scan.field)];
    const bool comparable = last.size() == scan.returns.size();
    std::vector<double> now;
    for (std::size_t i = 0; i < scan.returns.size(); ++i) {
      const Return& r = scan.returns[i];
      const double across = scan.axis == StripeAxis::kColumns ? r.v_px : r.u_px;
      now.push_back(r.status == ReturnStatus::kOk ? across : NAN);
      if (!comparable || !std::isfinite(now[i]) || !std::isfinite(last[i])) continue;
      change_px_ += std::abs(now[i] - last[i]);
      ++changes_;
    }
    last = std::move(now);
  }

  int scans_ = 0;
  long lines_ = 0;
  long good_ = 0;
  long used_ = 0;
  long changes_ = 0;
  double squares_m2_ = 0.0;
  double squares_sigmas_ = 0.0;
  double change_px_ = 0.0;
  double sigma_cal_m_ = NAN;
  std::vector<double> distances_m_;
  std::map<int, std::vector<double>> last_px_;
};

void define(Command& command, VerifyArguments& arguments) {
  add_source(command, arguments.source);
  add_scanner_arguments(command, arguments.scanner);
  command.get_option("--model")->required()->description(
      "The calibrated striper to check (striper.yaml)");
  add_frame_limits(command, arguments.limits);
  command
      .add_option("--distance", arguments.distance_m,
                  "True distance of the target from the scan origin, square to it, metres")
      ->type_name("M")
      ->check(above_zero());
  command
      .add_option("--min-fill", arguments.least_fill,
                  fmt::format("Least part of the scan lines with a return; default {}",
                              arguments.least_fill))
      ->type_name("PART");
  command
      .add_option(
          "--max-ratio", arguments.most_ratio,
          fmt::format("Most scatter, in predicted sigmas; default {}", arguments.most_ratio))
      ->type_name("RATIO")
      ->check(above_zero());
  command
      .add_option("--at", arguments.at,
                  "The same target at another known distance, in frames of its own, held against "
                  "it as --distance is; needs --distance and two of these: linearity")
      ->type_name("M=SOURCE")
      ->one_word_each();
  auto* const step = command
                         .add_option("--step", arguments.step_m,
                                     "The target is a step of so many metres (surfaces alongside)")
                         ->type_name("M")
                         ->check(above_zero());
  command
      .add_option("--radius", arguments.radius_m,
                  "The target is a cylinder of so many metres' radius; nothing else in view")
      ->type_name("M")
      ->check(above_zero())
      ->excludes(step);
  command.add_flag("--json", arguments.json, "The figures for programs");
  command.footer(std::string(kSourceHelp) + "\n\n" + kExamples);
}

// A step's height or a cylinder's radius beside the known one.
class KnownTarget {
 public:
  KnownTarget(const VerifyArguments& arguments, std::shared_ptr<const StriperModel> model)
      : known_m_(arguments.step_m ? arguments.step_m : arguments.radius_m),
        measurer_({parse_measure_tool(arguments.step_m ? "target:step" : "target:circle")},
                  std::move(model)) {}

  void add(const PolarScan& scan) {
    if (!known_m_) return;
    const Measurement& m = measurer_.measure(scan)[0];
    ++scans_;
    if (m.status != MeasureStatus::kOk) return;
    ++count_;
    sum_m_ += std::abs(m.value);
    variance_m2_ += m.sigma * m.sigma;
    sigma_cal_m_ = std::isfinite(m.sigma_cal) ? m.sigma_cal : 0.0;
  }

  bool is_any() const noexcept { return known_m_.has_value(); }
  double mean_m() const { return count_ > 0 ? sum_m_ / count_ : NAN; }
  double sigma_m() const { return std::hypot(std::sqrt(variance_m2_) / count_, sigma_cal_m_); }
  // Within three sigmas of the known one in most scans at least.
  bool is_right() const {
    return 2 * count_ > scans_ && std::abs(mean_m() - *known_m_) <= 3.0 * sigma_m();
  }
  nlohmann::json to_json() const {
    if (count_ == 0) return {{"known_m", *known_m_}, {"measured_m", nullptr}, {"count", 0}};
    return {{"known_m", *known_m_},
            {"measured_m", mean_m()},
            {"error_m", mean_m() - *known_m_},
            {"sigma_m", sigma_m()},
            {"count", count_}};
  }
  std::string line() const {
    if (count_ == 0) return "target: not found";
    return fmt::format(
        "target: {:.3f} mm measured, {:.3f} mm known, error {:+.3f} +- {:.3f} mm "
        "(k = 2; {} scans)",
        1e3 * mean_m(), 1e3 * *known_m_, 1e3 * (mean_m() - *known_m_), 2e3 * sigma_m(), count_);
  }

 private:
  std::optional<double> known_m_;
  Measurer measurer_;
  int scans_ = 0;
  int count_ = 0;
  double sum_m_ = 0.0;
  double variance_m2_ = 0.0;
  double sigma_cal_m_ = 0.0;
};

// Scans a source as the options say. `on_scans` also hears how long they took.
FrameReport scan_all(const VerifyArguments& arguments, const std::string& uri,
                     const EventPort& events,
                     const std::function<void(ScanSpan, double)>& on_scans) {
  using Clock = std::chrono::steady_clock;
  auto source = open_source(uri, events);
  const ScannerSetup setup = scanner_setup(arguments.scanner, source->info(), events);
  Scanner scanner = make_scanner(setup);
  StripeWatch watch(arguments.scanner, setup);
  const FrameReport read = read_frames(*source, arguments.limits, events, [&](const Frame& frame) {
    watch.keep(frame);
    const Clock::time_point start = Clock::now();
    const ScanSpan scans = scanner.process(frame);
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    watch.look_at(scans);
    on_scans(scans, seconds);
  });
  const ScanSpan rest = scanner.finish();
  watch.look_at(rest);
  on_scans(rest, 0.0);
  watch.conclude();
  let_go(std::move(source), read);
  return read;
}

// `M=SOURCE`
std::pair<double, std::string> distance_and_source(const std::string& text) {
  const std::size_t equals = text.find('=');
  char* end = nullptr;
  const double known_m = std::strtod(text.c_str(), &end);
  if (equals == std::string::npos || end != text.c_str() + equals || !(known_m > 0.0))
    throw Error(ErrorKind::kUsage, fmt::format("--at {}: expected M=SOURCE", text));
  return {known_m, text.substr(equals + 1)};
}

// Three distances are the fewest that can be off a straight line, and each is another.
void require_distances(const VerifyArguments& arguments) {
  std::set<double> known;
  if (arguments.distance_m) known.insert(*arguments.distance_m);
  for (const std::string& text : arguments.at) {
    if (!known.insert(distance_and_source(text).first).second) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("--at {}: expected a distance that no other target has", text));
    }
  }
  if (arguments.at.empty() || (arguments.distance_m && arguments.at.size() > 1)) return;
  throw Error(ErrorKind::kUsage,
              "--at: expected --distance and two of these at least: linearity is of three");
}

// All distances of which both is known: what they are and what they measure.
struct Distances {
  std::vector<KnownDistance> known;
  std::string failed;  // Of those in frames of their own.
};

Distances known_distances(const VerifyArguments& arguments, const Verification& main,
                          const EventPort& events) {
  Distances distances;
  if (arguments.distance_m)
    distances.known.push_back({*arguments.distance_m, main.mean_distance_m()});
  for (const std::string& text : arguments.at) {
    const auto [known_m, uri] = distance_and_source(text);
    Verification there;
    scan_all(arguments, uri, events, [&](ScanSpan scans, double) {
      for (const PolarScan& scan : scans) there.add(scan);
    });
    distances.known.push_back({known_m, there.mean_distance_m()});
    VerifyArguments of_there = arguments;
    of_there.distance_m = known_m;
    const std::string failed = there.failures(of_there);
    if (!failed.empty()) distances.failed += fmt::format("; at {:g} m {}", known_m, failed);
  }
  return distances;
}

nlohmann::json say_linearity(const std::vector<KnownDistance>& distances) {
  constexpr std::size_t kFewest = 3;
  if (distances.size() < kFewest) return nullptr;
  const Linearity found = linearity(distances);
  double least = std::numeric_limits<double>::infinity();
  double most = 0.0;
  nlohmann::json errors = nlohmann::json::array();
  for (const KnownDistance& one : distances) {
    least = std::min(least, one.known_m);
    most = std::max(most, one.known_m);
    errors.push_back({{"known_m", one.known_m}, {"measured_m", one.measured_m}});
  }
  say(
      fmt::format("z linearity: {:.3f} mm, {:.3f} % of the {:.3f} m between them (largest error of "
                  "{} distances beside the best straight line; gain {:.5f}, offset {:+.3f} mm)",
                  1e3 * found.most_m, 100.0 * found.most_m / (most - least), most - least,
                  distances.size(), found.gain, 1e3 * found.offset_m));
  return {{"most_m", found.most_m},
          {"gain", found.gain},
          {"offset_m", found.offset_m},
          {"distances", errors}};
}

ExitCode verify(const VerifyArguments& arguments) {
  if (!(arguments.least_fill >= 0.0 && arguments.least_fill <= 1.0)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("--min-fill {}: expected a part, 0 to 1", arguments.least_fill));
  }
  require_distances(arguments);
  const TerminalEvents events({"no_stripe", "stripe_seen"});  // StripeWatch says more.
  const auto model = std::make_shared<const StriperModel>(load_model(*arguments.scanner.model));
  Verification verification;
  VerifySheet sheet;
  KnownTarget target(arguments, model);
  const FrameReport read =
      scan_all(arguments, arguments.source, events.port(), [&](ScanSpan scans, double seconds) {
        if (seconds > 0.0) sheet.took(seconds);
        for (const PolarScan& scan : scans) {
          verification.add(scan);
          sheet.add(scan);
          target.add(scan);
        }
      });
  const double rate_hz =
      read.elapsed_s > 0.0 ? static_cast<double>(read.pictures) / read.elapsed_s : NAN;
  const nlohmann::json figures =
      sheet.to_json(measuring_range(*model, 0), rate_hz, verification.distances_m());
  for (const std::string& line : sheet_lines(figures)) say(line);
  if (target.is_any()) say(target.line());
  const Distances distances = known_distances(arguments, verification, events.port());
  const nlohmann::json of_distances = say_linearity(distances.known);
  std::string failed = verification.failures(arguments) + distances.failed;
  if (failed.starts_with("; ")) failed.erase(0, 2);
  if (!target.is_any()) {
    verification.say_result(arguments);
    say(failed.empty() ? std::string("passed") : "failed: " + failed);
  }
  const bool is_right = target.is_any() ? target.is_right() : failed.empty();
  if (arguments.json) {
    nlohmann::json json = verification.result(arguments);
    json["sheet"] = figures;
    json["linearity"] = of_distances;
    json["target"] = nullptr;
    if (target.is_any()) json["target"] = target.to_json();
    json["passed"] = is_right;
    print_json(json);
  }
  return is_right && !read.is_lost ? ExitCode::kDone : ExitCode::kFailed;
}

}  // namespace

void add_verify(Command& striper, Action& action) {
  add_command<VerifyArguments>(striper, action, "verify", kDescription, define, verify);
}

}  // namespace striper::program
