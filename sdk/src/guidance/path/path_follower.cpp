// SPDX-License-Identifier: Apache-2.0
#include "guidance/path/path_follower.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// A line is looked for this far around where it is predicted, in sigma, and within these bounds:
// half a stripe's wear; all of a window, and less than to the other line of a double one.
constexpr double kGateSigmas = 5.0;
constexpr double kLeastGate_m = 0.05;
constexpr double kMostGate_m = 1.0;
constexpr double kPairShare = 0.45;
// Slower, a yaw rate says nothing of the way's curvature.
constexpr double kLeastSpeed_m_s = 0.5;
// A gyroscope's errors are alike for a while: it is asked so often, and the speed that its reading
// is divided by is off by so much.
constexpr double kTurnEvery_m = 0.1;
constexpr double kSpeedShare = 0.02;

}  // namespace

PathFollower::PathFollower(const GuidanceConfig& config)
    : smoothing_(config.smoothing),
      stripe_(config.stripe),
      gun_x_m_(config.guns.empty() ? 0.0 : config.guns.front().gun.x_m),
      count_m_(config.beams.front().sample_m()),
      seen_m_(config.beams.size(), kUnknown),
      last_seen_m_(config.beams.size(), kUnknown) {
  std::vector<double> beam_x_m;
  for (const GuidanceBeam& beam : config.beams) beam_x_m.push_back(beam.x_m);
  if (smoothing_.method == PathMethod::kFilter) {
    PathFilterOptions options;
    options.beam_x_m = beam_x_m;
    options.gap_limit_m = stripe_.gap_limit_m;
    filter_.emplace(options);
    return;
  }
  ReportPathOptions options;
  for (const double x_m : beam_x_m) options.beam_x_m.push_back(x_m - gun_x_m_);
  options.alpha = smoothing_.method == PathMethod::kInteger ? 0.0 : smoothing_.alpha;
  report_.emplace(options);
}

void PathFollower::advance(double distance_m) noexcept {
  if (!std::isfinite(distance_m)) return;
  distance_m_ = distance_m;
  if (filter_) filter_->advance(distance_m);
}

ExpectedLine PathFollower::expected(std::size_t beam, double since_m) const noexcept {
  ExpectedLine expected;
  if (!filter_) {
    expected.lateral_m = last_seen_m_[beam];  // The report took what it saw.
    return expected;
  }
  const double x_m = filter_->beam_x_m(beam) - since_m;
  expected.lateral_m = filter_->lateral_at(x_m);
  if (std::isnan(expected.lateral_m)) return expected;
  const double sigma_m = std::hypot(filter_->sigma_at(x_m), filter_->wear_m());
  double most_m = kMostGate_m;
  if (stripe_.follow != FollowLine::kSingle) {
    most_m = std::min(most_m, kPairShare * stripe_.line_spacing_m());
  }
  expected.within_m = std::clamp(kGateSigmas * sigma_m, kLeastGate_m, most_m);
  return expected;
}

bool PathFollower::see(const StripeSight& sight) noexcept {
  last_seen_m_[sight.beam] = sight.lateral_m;
  seen_m_[sight.beam] = sight.lateral_m;
  if (filter_) return filter_->see(sight).is_taken;
  seen_at_m_ = distance_m_;
  return true;
}

void PathFollower::see_yaw_rate(double yaw_rate_rad_s, double sigma_rad_s,
                                double speed_m_s) noexcept {
  if (!filter_ || !(speed_m_s > kLeastSpeed_m_s)) return;
  if (distance_m_ - turn_seen_at_m_ < kTurnEvery_m) return;
  turn_seen_at_m_ = distance_m_;
  const double curvature_1_m = yaw_rate_rad_s / speed_m_s;
  filter_->see_curvature(curvature_1_m,
                         std::hypot(sigma_rad_s / speed_m_s, kSpeedShare * curvature_1_m));
}

void PathFollower::end_scan() noexcept {
  if (report_) {
    const double now_m = report_->update(seen_m_).lateral_m;
    const bool is_integer = smoothing_.method == PathMethod::kInteger && std::isfinite(now_m) &&
                            std::isfinite(answer_m_);
    answer_m_ = is_integer ? count_m_ * report_integer_smoothing(
                                            static_cast<int>(std::lround(now_m / count_m_)),
                                            static_cast<int>(std::lround(answer_m_ / count_m_)))
                           : now_m;
  }
  std::fill(seen_m_.begin(), seen_m_.end(), kUnknown);
}

PathFollower::Answer PathFollower::at_gun() const noexcept {
  if (!filter_) return simple_answer();
  return {filter_->lateral_at(gun_x_m_), filter_->sigma_at(gun_x_m_), filter_->unseen_m()};
}

double PathFollower::after(double way_m) const noexcept {
  return filter_ ? filter_->lateral_after(gun_x_m_ + way_m) : kUnknown;
}

PathFollower::Answer PathFollower::simple_answer() const noexcept {
  Answer answer;
  if (!std::isfinite(seen_at_m_)) return answer;
  answer.unseen_m = distance_m_ - seen_at_m_;
  if (answer.unseen_m <= stripe_.gap_limit_m) answer.lateral_m = answer_m_;
  return answer;
}

}  // namespace striper::detail
