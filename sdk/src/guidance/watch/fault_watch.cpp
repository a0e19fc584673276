// SPDX-License-Identifier: Apache-2.0
#include "guidance/watch/fault_watch.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

// A sweep or a reading is missed so long after it was due.
constexpr double kLate_s = 0.002;
// Heads that are started together begin within less.
constexpr double kStart_s = 1.0;
// A mirror's rate is held by a crystal; this much off, its motor has lost it.
constexpr double kMirrorShare = 0.05;
constexpr int kSteady = 5;  // Readings of a mirror.
constexpr double kLearn = 0.1;
constexpr double kMostPeriods = 3.0;  // A longer step is an outage, and no period.

}  // namespace

FaultWatch::FaultWatch(const GuidanceConfig& config) : actions_(config.faults) {
  for (const GuidanceBeam& beam : config.beams) {
    beams_.push_back({std::numeric_limits<double>::quiet_NaN(), 1.0 / beam.rate_hz});
    is_used_.push_back(beam.use == BeamUse::kOff ? 0 : 1);
  }
  is_blind_.assign(beams_.size(), 0);
}

double FaultWatch::Rhythm::due_s() const noexcept { return last_s + period_s; }

double FaultWatch::due_s(const Rhythm& beam) const noexcept {
  return std::isfinite(beam.last_s) ? beam.due_s() : first_sweep_s_ + kStart_s;
}

// One reading may be missing. NaN before the first.
double FaultWatch::odometer_due_s() const noexcept {
  return odometer_.period_s > 0.0 ? odometer_.due_s() + odometer_.period_s
                                  : odometer_.last_s + kStart_s;
}

void FaultWatch::set(GuidanceFault fault, bool is_on, double since_s) noexcept {
  State& state = states_[static_cast<std::size_t>(fault)];
  if (is_on == state.is_on) return;
  state = {is_on, false, since_s};
}

void FaultWatch::sweep(std::size_t beam, double time_s, bool is_blind) noexcept {
  if (std::isnan(first_sweep_s_)) first_sweep_s_ = time_s;
  beams_[beam].last_s = time_s;
  is_blind_[beam] = is_blind && is_used_[beam] != 0 ? 1 : 0;
  const bool is_any =
      std::any_of(is_blind_.begin(), is_blind_.end(), [](char c) { return c != 0; });
  set(GuidanceFault::kBeamBlind, is_any, time_s);
  set(GuidanceFault::kTime, false, time_s);
}

void FaultWatch::odometer(double time_s, bool is_plausible) noexcept {
  if (std::isfinite(odometer_.last_s)) {
    const double period_s = time_s - odometer_.last_s;
    const bool is_first = !(odometer_.period_s > 0.0);
    // The first one is taken as it is; later ones move it slowly.
    if (period_s > 0.0 && (is_first || period_s < kMostPeriods * odometer_.period_s)) {
      odometer_.period_s += (is_first ? 1.0 : kLearn) * (period_s - odometer_.period_s);
    }
  }
  odometer_.last_s = time_s;
  set(GuidanceFault::kOdometer, !is_plausible, time_s);
}

void FaultWatch::truck(const TruckState& state) noexcept {
  set(GuidanceFault::kLaserOff, state.laser == 0, state.time_s);
  if (std::isnan(state.mirror_hz)) return;
  set(GuidanceFault::kMirror, is_mirror_wrong(state.mirror_hz), state.time_s);
}

// While it spins up it is only wrong where it stands; then its rate is what it held.
bool FaultWatch::is_mirror_wrong(double mirror_hz) noexcept {
  const auto is_alike = [&](double hz) { return std::abs(mirror_hz - hz) <= kMirrorShare * hz; };
  if (std::isfinite(mirror_hz_)) return !is_alike(mirror_hz_);
  steady_ = is_alike(last_mirror_hz_) ? steady_ + 1 : 1;
  last_mirror_hz_ = mirror_hz;
  if (steady_ >= kSteady && mirror_hz > 0.0) mirror_hz_ = mirror_hz;
  return !(mirror_hz > 0.0);
}

void FaultWatch::time_jumped(double time_s) noexcept { set(GuidanceFault::kTime, true, time_s); }
void FaultWatch::stripe(bool is_missing, double time_s) noexcept {
  set(GuidanceFault::kNoStripe, is_missing, time_s);
}
void FaultWatch::queue(bool is_full, double time_s) noexcept {
  set(GuidanceFault::kQueueFull, is_full, time_s);
}

void FaultWatch::look_for_silence(double now_s) noexcept {
  bool is_silent = false;
  double since_s = 0.0;
  for (std::size_t i = 0; i < beams_.size(); ++i) {
    if (is_used_[i] == 0 || !(now_s > due_s(beams_[i]) + kLate_s)) continue;
    is_silent = true;
    since_s = due_s(beams_[i]);
  }
  set(GuidanceFault::kBeamSilent, is_silent, since_s);
  if (now_s > odometer_due_s() + kLate_s) set(GuidanceFault::kOdometer, true, odometer_due_s());
}

std::optional<FaultLine> FaultWatch::take(double now_s) noexcept {
  look_for_silence(now_s);
  for (std::size_t i = 0; i < kGuidanceFaults; ++i) {
    State& state = states_[i];
    if (!state.is_on || state.is_told) continue;
    state.is_told = true;
    const auto fault = static_cast<GuidanceFault>(i);
    return FaultLine{now_s, fault, actions_[i], std::max(now_s - state.since_s, 0.0)};
  }
  return {};
}

std::optional<FaultAction> FaultWatch::action() const noexcept {
  std::optional<FaultAction> worst;
  for (std::size_t i = 0; i < kGuidanceFaults; ++i) {
    if (!states_[i].is_on || actions_[i] == FaultAction::kWarn) continue;
    if (!worst || actions_[i] < *worst) worst = actions_[i];
  }
  return worst;
}

bool FaultWatch::is_on(GuidanceFault fault) const noexcept {
  return states_[static_cast<std::size_t>(fault)].is_on;
}

}  // namespace striper::detail
