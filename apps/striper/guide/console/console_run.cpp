// SPDX-License-Identifier: Apache-2.0
#include "guide/console/console_run.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace striper::program {

ConsoleRun::ConsoleRun(const std::filesystem::path& directory, const GuidanceConfig& config,
                       const EventPort& events)
    : recorded_(config),
      inputs_(directory, config, events),
      odometer_(config.odometer),
      sweeps_(config.beams.size()) {}

bool ConsoleRun::go_on(double seconds) {
  until_s_ += seconds;
  while (!has_begun_ || now_s_ < until_s_) {
    if (!inputs_.give_next(*this)) return false;
  }
  return true;
}

void ConsoleRun::set_laser(bool is_on) {
  is_laser_on_ = is_on;
  if (guidance_) guidance_->take(TruckState{now_s_, is_on ? 1 : 0});
}

void ConsoleRun::start_guidance(const GuidanceConfig& config) {
  GuidanceConfig playing = config;
  for (std::size_t i = 0; i < playing.beams.size(); ++i) {
    playing.beams[i].y_left_m = recorded_.beams[i].y_left_m;
    playing.beams[i].y_right_m = recorded_.beams[i].y_right_m;
    playing.beams[i].fan_rad = recorded_.beams[i].fan_rad;
    playing.beams[i].sweep_s = recorded_.beams[i].sweep_s;
    playing.beams[i].samples = recorded_.beams[i].samples;
  }
  lateral_.reset();
  guns_.assign(playing.guns.size(), false);
  GuidanceListener& listener = *this;
  guidance_.emplace(playing, listener);
}

void ConsoleRun::stop_guidance() {
  if (guidance_) guidance_->finish();
  guidance_.reset();
  guns_.assign(guns_.size(), false);
}

const BeamSweep* ConsoleRun::last_sweep(std::size_t beam) const noexcept {
  return is_laser_on_ && beam < sweeps_.size() && sweeps_[beam] ? &*sweeps_[beam] : nullptr;
}

std::optional<GuidanceTotals> ConsoleRun::totals() const {
  return guidance_ ? std::optional(guidance_->totals()) : std::nullopt;
}

std::optional<FaultLine> ConsoleRun::take_fault() { return std::exchange(fault_, std::nullopt); }

void ConsoleRun::switch_gun(std::size_t gun, bool is_on, double /*time_s*/) { guns_[gun] = is_on; }

void ConsoleRun::take(const OdometerReading& reading) {
  has_odometer_ = true;
  shown_counts_ = reading.counts;
  odometer_.update(reading);
  now_s_ = reading.time_s;
  if (!has_begun_) until_s_ += now_s_;
  has_begun_ = true;
  if (guidance_) guidance_->take(reading);
}

void ConsoleRun::take(const TruckState& state) {
  if (guidance_) guidance_->take(state);
}

void ConsoleRun::take(const BeamSweep& sweep) {
  now_s_ = sweep.time_s;
  if (!has_begun_) until_s_ += now_s_;
  has_begun_ = true;
  if (!has_odometer_) {
    shown_counts_ = sweep.odometer_counts;
    odometer_.update(
        {sweep.time_s, sweep.odometer_counts, std::numeric_limits<double>::quiet_NaN()});
  }
  if (!is_laser_on_) return;
  if (guidance_) guidance_->take(sweep);
  for (std::size_t i = 0; i < recorded_.beams.size(); ++i) {
    if (recorded_.beams[i].name == sweep.beam) sweeps_[i] = sweep;
  }
}

}  // namespace striper::program
