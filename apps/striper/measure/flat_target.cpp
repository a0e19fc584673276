// SPDX-License-Identifier: Apache-2.0
#include "measure/flat_target.hpp"

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/robust.hpp>
#include <striper/geometry/line_fit.hpp>

#include "program/terminal.hpp"

namespace striper::program {
namespace {

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

}  // namespace

void FlatTarget::add(const PolarScan& scan) {
  const FlatScan flat = check(scan);
  ++scans_;
  lines_ += flat.lines;
  good_ += flat.good;
  used_ += flat.used;
  squares_m2_ += flat.squares_m2;
  squares_sigmas_ += flat.squares_sigmas;
  if (std::isfinite(flat.distance_m)) distances_m_.push_back(flat.distance_m);
  if (std::isfinite(flat.sigma_cal_m)) sigma_cal_m_ = flat.sigma_cal_m;
  compare_with_last(scan);
}

nlohmann::json FlatTarget::to_json(const FlatCriteria& criteria) const {
  nlohmann::json json;
  json["scans"] = scans_;
  json["fill"] = fill();
  json["flatness_rms_m"] = flatness_m();
  json["flatness_over_sigma"] = ratio();
  json["temporal_px"] = temporal_px();
  json["distance_m"] = mean_distance_m();
  if (criteria.distance_m) {
    json["bias_m"] = mean_distance_m() - *criteria.distance_m;
    json["sigma_cal_m"] = sigma_cal_m_;
  }
  return json;
}

double FlatTarget::mean_distance_m() const {
  double sum = 0.0;
  for (const double d : distances_m_) sum += d;
  return distances_m_.empty() ? NAN : sum / static_cast<double>(distances_m_.size());
}

void FlatTarget::say_result(const FlatCriteria& criteria) const {
  say(fmt::format("{} scans of a flat target at {:.4f} m (square to it)", scans_,
                  mean_distance_m()));
  say(fmt::format("fill: {:.1f} % of the scan lines have a return", 100.0 * fill()));
  say(fmt::format("flatness: {:.3f} mm rms, {:.2f} times what the error bars say",
                  1e3 * flatness_m(), ratio()));
  if (changes_ > 0)
    say(fmt::format("temporal noise: {:.3f} px mean change from scan to scan", temporal_px()));
  if (criteria.distance_m) say_bias(mean_distance_m() - *criteria.distance_m);
}

std::vector<std::string> FlatTarget::failures(const FlatCriteria& criteria) const {
  if (used_ == 0) return {"no flat target was seen"};
  std::vector<std::string> failures;
  if (fill() < criteria.least_fill)
    failures.push_back(
        fmt::format("fill {:.2f} is below {:.2f} (--min-fill)", fill(), criteria.least_fill));
  if (ratio() > criteria.most_ratio)
    failures.push_back(
        fmt::format("the scatter is {:.2f} times the error bars, above {:.2f} (--max-ratio): the "
                    "target is not flat, or the lens or the noise is not the model's",
                    ratio(), criteria.most_ratio));
  if (!criteria.distance_m) return failures;
  const double bias_m = std::abs(mean_distance_m() - *criteria.distance_m);
  const double known_m = std::isfinite(sigma_cal_m_) ? sigma_cal_m_ : 0.0;
  // What a still scene's errors have in common with those of the next scan is not averaged out.
  const double of_scan = static_cast<double>(used_) / std::max(scans_, 1);
  if (bias_m > 3.0 * known_m + 3.0 * flatness_m() / std::sqrt(of_scan) + 1e-6)
    failures.push_back(
        fmt::format("the bias of {:.2f} mm is beyond {}", 1e3 * bias_m,
                    known_m > 0.0 ? "three sigmas of the calibration"
                                  : "the scatter, which is all that a model without covariance "
                                    "leaves to hold it against"));
  return failures;
}

void FlatTarget::say_bias(double bias_m) const {
  const std::string sigma = std::isfinite(sigma_cal_m_)
                                ? fmt::format("{:.3f} mm", 1e3 * sigma_cal_m_)
                                : "not known, the model has no covariance";
  say(fmt::format("bias: {:+.3f} mm (calibration error, one sigma: {})", 1e3 * bias_m, sigma));
}

// The paper's figure: how far the stripe of a column moves between two scans of a still target.
void FlatTarget::compare_with_last(const PolarScan& scan) {
  std::vector<double>& last = last_px_[{scan.laser, static_cast<int>(scan.field)}];
  const bool comparable = last.size() == scan.returns.size();
  std::vector<double> now;
  now.reserve(scan.returns.size());
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    const Return& r = scan.returns[i];
    now.push_back(r.status == ReturnStatus::kOk ? r.across_px(scan.axis) : NAN);
    if (!comparable || !std::isfinite(now[i]) || !std::isfinite(last[i])) continue;
    change_px_ += std::abs(now[i] - last[i]);
    ++changes_;
  }
  last = std::move(now);
}

}  // namespace striper::program
