// SPDX-License-Identifier: Apache-2.0
// striper verify: scans a flat target and holds what is measured against what the model promises.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>

#include "frame_loop.hpp"
#include "program.hpp"
#include "scanner_arguments.hpp"
#include "stripe_watch.hpp"
#include "summary.hpp"
#include "terminal.hpp"
#include "terminal_events.hpp"

namespace striper::program {
namespace {

struct VerifyArguments {
  std::string source;
  ScannerArguments scanner;
  FrameLimits limits;
  std::optional<double> distance_m;
  double least_fill = 0.9;
  double most_ratio = 2.0;
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
    "      the wall is 1.500 m from the scan origin, measured square to it\n\n"
    "Flatness: rms of the returns about a straight line, and the same over each return's own\n"
    "sigma (1 where the error bars are right). Temporal noise: mean change of a column's stripe\n"
    "between successive scans, px. Exit code 0 passed, 1 failed.";

// One straight line through a scan's good returns, by weighted least squares on the distance along
// the ray, twice with the worst taken out.
struct FlatScan {
  int good = 0;
  int lines = 0;
  double squares_m2 = 0.0;
  double squares_sigmas = 0.0;
  int used = 0;
  double distance_m = NAN;  // Of the line from the scan origin.
  double sigma_cal_m = NAN;
};

struct Line {
  Eigen::Vector2d normal;
  double distance_m;
};

// n . p = d with |n| = 1, by total least squares with weights.
Line fit(const std::vector<const Return*>& returns) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double weights = 0.0;
  const auto weight = [](const Return& r) { return 1.0 / (r.sigma_m * r.sigma_m); };
  for (const Return* r : returns) {
    mean += weight(*r) * Eigen::Vector2d(r->x_m, r->y_m);
    weights += weight(*r);
  }
  mean /= weights;
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (const Return* r : returns) {
    const double dx = r->x_m - mean.x();
    const double dy = r->y_m - mean.y();
    xx += weight(*r) * dx * dx;
    xy += weight(*r) * dx * dy;
    yy += weight(*r) * dy * dy;
  }
  const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);
  Line line{{-std::sin(angle), std::cos(angle)}, 0.0};
  line.distance_m = line.normal.dot(mean);
  if (line.distance_m < 0.0) line = {-line.normal, -line.distance_m};
  return line;
}

// Distance from the line along the return's own ray.
double along_ray_m(const Line& line, const Return& r) {
  const Eigen::Vector2d direction(std::cos(r.bearing_rad), std::sin(r.bearing_rad));
  return r.range_m - line.distance_m / line.normal.dot(direction);
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
  Line line = fit(good);
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
  flat.distance_m = line.distance_m;
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
    json["passed"] = failures(arguments).empty();
    return json;
  }

  void say_result(const VerifyArguments& arguments) const {
    say(fmt::format("{} scans of a flat target at {:.4f} m (square to it)", scans_,
                    mean_distance_m()));
    say(fmt::format("fill: {:.1f} % of the lines have a return", 100.0 * fill()));
    say(fmt::format("flatness: {:.3f} mm rms, {:.2f} times what the error bars say",
                    1e3 * flatness_m(), ratio()));
    if (changes_ > 0)
      say(fmt::format("temporal noise: {:.3f} px mean change from scan to scan", temporal_px()));
    if (arguments.distance_m) say_bias(mean_distance_m() - *arguments.distance_m);
    const std::string failed = failures(arguments);
    say(failed.empty() ? std::string("passed") : "failed: " + failed);
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
    if (bias_m > 3.0 * known_m + 3.0 * flatness_m() / std::sqrt(static_cast<double>(used_)) + 1e-6)
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
  double mean_distance_m() const {
    double sum = 0.0;
    for (const double d : distances_m_) sum += d;
    return distances_m_.empty() ? NAN : sum / static_cast<double>(distances_m_.size());
  }

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

void define(CLI::App& command, VerifyArguments& arguments) {
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
      .add_option(
          "--min-fill", arguments.least_fill,
          fmt::format("Least part of the lines with a return; default {}", arguments.least_fill))
      ->type_name("PART");
  command
      .add_option(
          "--max-ratio", arguments.most_ratio,
          fmt::format("Most scatter, in predicted sigmas; default {}", arguments.most_ratio))
      ->type_name("RATIO")
      ->check(above_zero());
  command.add_flag("--json", arguments.json, "The figures for programs");
  command.footer(std::string(kSourceHelp) + "\n\n" + kExamples);
}

ExitCode verify(const VerifyArguments& arguments) {
  if (!(arguments.least_fill >= 0.0 && arguments.least_fill <= 1.0)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("--min-fill {}: expected a part, 0 to 1", arguments.least_fill));
  }
  const TerminalEvents events({"no_stripe", "stripe_seen"});  // StripeWatch says more.
  auto source = open_source(arguments.source, events.port());
  const ScannerSetup setup = scanner_setup(arguments.scanner, source->info(), events.port());
  Scanner scanner = make_scanner(setup);
  StripeWatch watch(arguments.scanner, setup);
  Verification verification;
  const auto keep = [&](ScanSpan scans) {
    watch.look_at(scans);
    for (const PolarScan& scan : scans) verification.add(scan);
  };
  const FrameLoopResult read = read_frames(*source, arguments.limits, [&](const Frame& frame) {
    watch.keep(frame);
    keep(scanner.process(frame));
  });
  keep(scanner.finish());
  watch.conclude();
  verification.say_result(arguments);
  if (arguments.json) print_json(verification.result(arguments));
  let_go(std::move(source), read);
  const bool is_passed = verification.failures(arguments).empty() && !read.is_lost;
  return is_passed ? ExitCode::kDone : ExitCode::kFailed;
}

}  // namespace

void add_verify(CLI::App& striper, Action& action) {
  add_command<VerifyArguments>(striper, action, "verify", kDescription, define, verify);
}

}  // namespace striper::program
