// SPDX-License-Identifier: Apache-2.0
#include "guidance/align/alignment_sigma.hpp"

#include <algorithm>
#include <cmath>

#include <striper/guidance/path_filter.hpp>

namespace striper::detail {
namespace {

// Long enough for the filter to settle, in steps as of 40 mph at 176 sweeps a second.
constexpr double kSettle_m = 30.0;
constexpr double kStep_m = 0.1;
// Of a beam's sight on a clean line; and an error that is small beside what the filter reckons
// with, so that it stays linear.
constexpr double kSight_m = 0.001;
constexpr double kError_m = 0.0005;

double gun_x_m(const GuidanceConfig& config) {
  return config.guns.empty() ? 0.0 : config.guns.front().gun.x_m;
}

double share_of(const GuidanceConfig& config, std::size_t wrong, bool has_old_only) {
  PathFilterOptions options;
  for (const GuidanceBeam& beam : config.beams) options.beam_x_m.push_back(beam.x_m);
  PathFilter filter(options);
  for (double way_m = 0.0; way_m < kSettle_m; way_m += kStep_m) {
    filter.advance(way_m);
    for (std::size_t i = 0; i < config.beams.size(); ++i) {
      const BeamUse use = config.beams[i].use;
      if (use == BeamUse::kOff || (use == BeamUse::kOldOnly && !has_old_only)) continue;
      filter.see({i, i == wrong ? kError_m : 0.0, kSight_m, config.stripe.width_m, 0.0});
    }
  }
  const double at_gun_m = filter.lateral_at(gun_x_m(config));
  return std::isfinite(at_gun_m) ? at_gun_m / kError_m : 0.0;
}

}  // namespace

AlignmentSigma::AlignmentSigma(const GuidanceConfig& config)
    : offset_variance_(config.output.offset_sd_m * config.output.offset_sd_m) {
  if (config.alignment_covariance.empty()) return;
  const auto size = static_cast<Eigen::Index>(2 * config.beams.size());
  covariance_ = Eigen::Map<const Eigen::MatrixXd>(config.alignment_covariance.data(), size, size);
  const bool has_old_only =
      std::any_of(config.beams.begin(), config.beams.end(),
                  [](const GuidanceBeam& beam) { return beam.use == BeamUse::kOldOnly; });
  for (const bool with_old_only : {true, false}) {
    if (!with_old_only && !has_old_only) continue;
    std::vector<double> shares;
    for (std::size_t i = 0; i < config.beams.size(); ++i) {
      shares.push_back(share_of(config, i, with_old_only));
    }
    shares_.push_back(std::move(shares));
  }
}

double AlignmentSigma::at(std::span<const double> beam_lateral_m) const noexcept {
  double worst = 0.0;
  const auto lateral_m = [&](std::size_t i) {
    return i < beam_lateral_m.size() && std::isfinite(beam_lateral_m[i]) ? beam_lateral_m[i] : 0.0;
  };
  for (const std::vector<double>& shares : shares_) {
    double variance = 0.0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
      for (std::size_t k = 0; k < shares.size(); ++k) {
        const auto a = static_cast<Eigen::Index>(2 * i);
        const auto b = static_cast<Eigen::Index>(2 * k);
        const double of_pair = covariance_(a, b) + lateral_m(i) * covariance_(a + 1, b) +
                               lateral_m(k) * covariance_(a, b + 1) +
                               lateral_m(i) * lateral_m(k) * covariance_(a + 1, b + 1);
        variance += shares[i] * shares[k] * of_pair;
      }
    }
    worst = std::max(worst, variance);
  }
  return std::sqrt(worst + offset_variance_);
}

}  // namespace striper::detail
