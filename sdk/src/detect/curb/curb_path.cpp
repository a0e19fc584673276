// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/curb_path.hpp"

#include <cmath>

namespace striper::detail {
namespace {

double square(double x) noexcept { return x * x; }

double lateral_variance(const CurbFinding& seen, const CurbDetectorOptions& options) noexcept {
  return square(seen.sigma_lateral_m) + square(options.straightness_m);
}

double height_variance(const CurbFinding& seen) noexcept {
  const double least_m = 1e-4;
  return square(std::fmax(seen.sigma_height_m, least_m));
}

}  // namespace

void CurbPath::start(const CurbFinding& seen, const CurbDetectorOptions& options) noexcept {
  path_.mean = {seen.lateral_m, 0.0};
  path_.covariance =
      Eigen::Vector2d(lateral_variance(seen, options), square(options.slope)).asDiagonal();
  height_m_ = seen.height_m;
  height_variance_ = height_variance(seen);
}

void CurbPath::predict(double way_m, double turn_rad, const CurbDetectorOptions& options) noexcept {
  const double s = way_m;
  Eigen::Matrix2d f;
  f << 1.0, s, 0.0, 1.0;
  Eigen::Matrix2d q;
  q << s * s * s / 3.0, s * s / 2.0, s * s / 2.0, s;
  path_.predict(f, square(options.bend) * q);
  path_.covariance(1, 1) += square(turn_rad);
  height_variance_ += square(options.height_change_m) * s;
}

double CurbPath::distance2(const CurbFinding& seen,
                           const CurbDetectorOptions& options) const noexcept {
  const double lateral = square(seen.lateral_m - path_.mean[0]) /
                         (path_.covariance(0, 0) + lateral_variance(seen, options));
  const double height =
      square(seen.height_m - height_m_) / (height_variance_ + height_variance(seen));
  return lateral + (std::isfinite(height) ? height : 0.0);
}

void CurbPath::update(const CurbFinding& seen, const CurbDetectorOptions& options) noexcept {
  const Eigen::Vector2d lateral(1.0, 0.0);
  path_.correct(lateral,
                path_.innovation(lateral, seen.lateral_m, lateral_variance(seen, options)));
  if (!std::isfinite(seen.height_m) || !std::isfinite(seen.sigma_height_m)) return;
  const double share = height_variance_ / (height_variance_ + height_variance(seen));
  height_m_ += share * (seen.height_m - height_m_);
  height_variance_ *= 1.0 - share;
}

double CurbPath::sigma_lateral_m() const noexcept { return std::sqrt(path_.covariance(0, 0)); }
double CurbPath::sigma_slope() const noexcept { return std::sqrt(path_.covariance(1, 1)); }
double CurbPath::sigma_height_m() const noexcept { return std::sqrt(height_variance_); }

}  // namespace striper::detail
