// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/curb_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <striper/core/statistics.hpp>

namespace striper::detail {
namespace {

// No face is straight and no height the same along the road to less than this.
constexpr double kFaceSlack_rad = 3.0 * std::numbers::pi / 180.0;
constexpr double kHeightSlack_m = 0.004;

// A top of less is a box's or a wheel's as likely as a curb's.
constexpr double kLeastTop_m = 0.25;

// How often what looks like a curb stands on the road, by what is seen of it, before any travel.
constexpr double kObjectIfGroundBehind = 0.97;
constexpr double kObjectIfTopIsLong = 0.2;
constexpr double kObjectIfTopIsShort = 0.4;
constexpr double kHoleElse = 0.02;

double above(double value, double limit, double sigma, double slack) noexcept {
  return normal_below((value - limit) / std::hypot(sigma, slack));
}

double object_probability(const CurbEvidence& e) noexcept {
  if (e.is_ground_behind) return kObjectIfGroundBehind;
  return e.top_length_m >= kLeastTop_m ? kObjectIfTopIsLong : kObjectIfTopIsShort;
}

}  // namespace

double after(double probability, double log_odds) noexcept {
  const double odds =
      probability / (1.0 - probability) * std::exp(std::clamp(log_odds, -30.0, 30.0));
  return odds / (1.0 + odds);
}

void weigh(const CurbEvidence& e, const CurbOptions& options, CurbFinding& f) noexcept {
  const auto put = [&](CurbKind kind, double p) {
    f.posterior[static_cast<std::size_t>(kind)] = p;
  };
  f.posterior.fill(0.0);
  // exp(-BIC / 2) of a road that goes on, against what has a face and a top.
  const double odds = std::exp(std::clamp(0.5 * (e.gain - e.penalty), -30.0, 30.0));
  const double is_high = above(f.height_m, options.min_height_m, f.sigma_height_m, kHeightSlack_m);
  double rest = odds / (1.0 + odds) * is_high;
  put(CurbKind::kNone, 1.0 - rest);
  const auto take = [&](CurbKind kind, double part) {
    put(kind, rest * part);
    rest -= rest * part;
  };
  take(CurbKind::kRough, after(kOvergrown, f.overgrown_log_odds));
  if (e.is_down) {
    const double is_hole = e.is_ground_behind ? kObjectIfGroundBehind : kHoleElse;
    put(CurbKind::kDown, rest * (1.0 - is_hole));
    put(CurbKind::kNone, 1.0 - f.of(CurbKind::kRough) - f.of(CurbKind::kDown));
  } else {
    take(CurbKind::kRamp,
         1.0 - above(f.face_rad, kLeastFace_rad, f.sigma_face_rad, kFaceSlack_rad));
    take(CurbKind::kWall,
         above(f.height_m, options.max_height_m, f.sigma_height_m, kHeightSlack_m));
    take(CurbKind::kObject, object_probability(e));
    put(CurbKind::kUp, rest);
  }
  const auto best = std::max_element(f.posterior.begin(), f.posterior.end());
  f.kind = static_cast<CurbKind>(best - f.posterior.begin());
}

}  // namespace striper::detail
