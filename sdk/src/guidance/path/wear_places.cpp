// SPDX-License-Identifier: Apache-2.0
#include "guidance/path/wear_places.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

// A beam further behind sees a place when the way that was driven meanwhile is not known to a part
// of the wear any more: its looks count as new.
constexpr double kReach_m = 1.5;
// Copies reach this much further than the beams are apart: the truck turns, sweeps are not of one
// moment.
constexpr double kSpare = 1.1;

}  // namespace

WearPlaces::WearPlaces(std::span<const double> beam_x_m) noexcept
    : beams_(static_cast<int>(beam_x_m.size())) {
  const auto foremost = std::max_element(beam_x_m.begin(), beam_x_m.end());
  foremost_ = static_cast<int>(foremost - beam_x_m.begin());
  double reach_m = 0.0;
  for (std::size_t i = 0; i < beam_x_m.size(); ++i) {
    const double behind_m = *foremost - beam_x_m[i];
    sees_copies_[i] = behind_m > 0.0 && behind_m <= kReach_m;
    if (sees_copies_[i]) reach_m = std::max(reach_m, behind_m);
  }
  if (reach_m > 0.0) copies_ = kMostCopies;
  step_m_ = kSpare * reach_m / kMostCopies;
  clear();
}

void WearPlaces::clear() noexcept { place_m_.fill(kNowhere); }

WearPlaces::Bridge WearPlaces::bridge(int beam, double place_m, double length_m) const noexcept {
  Bridge bridge;
  double before_m = kNowhere;
  double after_m = kNowhere;
  const auto look_at = [&](int state) {
    const double at_m = place_m_[static_cast<std::size_t>(state)];
    if (at_m <= place_m && !(at_m <= before_m)) {
      before_m = at_m;
      bridge.before = state;
    } else if (at_m > place_m && !(at_m >= after_m)) {
      after_m = at_m;
      bridge.after = state;
    }
  };
  look_at(beam);
  const bool sees_copies = sees_copies_[static_cast<std::size_t>(beam)];
  for (int i = 0; sees_copies && i < copies_; ++i) look_at(beams_ + i);
  const double a = std::isnan(before_m) ? 0.0 : std::exp((before_m - place_m) / length_m);
  const double b = std::isnan(after_m) ? 0.0 : std::exp((place_m - after_m) / length_m);
  const double apart = 1.0 - a * a * b * b;  // Above 0: `after` is beyond the place.
  bridge.before_weight = a * (1.0 - b * b) / apart;
  bridge.after_weight = b * (1.0 - a * a) / apart;
  bridge.unknown = (1.0 - a * a) * (1.0 - b * b) / apart;
  return bridge;
}

std::optional<int> WearPlaces::arrive(int beam, double place_m) noexcept {
  place_of(beam) = place_m;
  if (beam != foremost_ || copies_ == 0) return {};
  if (place_m < place_of(beams_ + newest_) + step_m_) return {};
  newest_ = (newest_ + 1) % copies_;
  place_of(beams_ + newest_) = place_m;
  return beams_ + newest_;
}

}  // namespace striper::detail
