// SPDX-License-Identifier: Apache-2.0
#include "guide/run_inputs.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/scan_sweep.hpp>
#include <striper/motion/odometer_csv.hpp>
#include <striper/scans/open_scans.hpp>

namespace striper::program {
namespace {

namespace fs = std::filesystem;

constexpr double kNever = std::numeric_limits<double>::infinity();

fs::path scans_of(const fs::path& directory, const std::string& head) {
  for (const char* ending : {".mcap", ".csv"}) {
    fs::path file = directory / (head + ending);
    if (fs::exists(file)) return file;
  }
  throw Error(ErrorKind::kNotFound,
              fmt::format("there is neither {0}.mcap nor {0}.csv in {1}: the scans of head '{0}'",
                          head, directory.string()));
}

}  // namespace

RunInputs::RunInputs(const fs::path& directory, const GuidanceConfig& config,
                     const EventPort& events) {
  bool needs_sweeps = false;
  for (const GuidanceBeam& beam : config.beams) {
    if (beam.head.empty()) {
      needs_sweeps = true;
      continue;
    }
    HeadBeam head;
    head.beam = beam;
    head.scans = open_scans(scans_of(directory, beam.head).string(), nullptr, std::nullopt, events);
    heads_.push_back(std::move(head));
  }
  if (needs_sweeps) sweep_file_.emplace(open_sweeps_csv(directory / "sweeps.csv"));
  const fs::path odometer = directory / "odometer.csv";
  if (fs::exists(odometer) || !needs_sweeps) odometer_file_.emplace(open_odometer_csv(odometer));
  const fs::path state = directory / "state.csv";
  if (fs::exists(state)) {
    state_file_.emplace(CsvInput::open(state), truck_state_columns(), "table of the truck's state");
  }
  read_sweep();
  read_odometer();
  read_state();
  for (HeadBeam& head : heads_) read_head(head);
}

void RunInputs::read_sweep() {
  if (!sweep_file_) return;
  BeamSweep next = sweep_ ? std::move(*sweep_) : BeamSweep{};
  if (sweep_file_->next(next)) {
    sweep_ = std::move(next);
  } else {
    sweep_.reset();
  }
}

void RunInputs::read_odometer() {
  if (!odometer_file_) return;
  OdometerReading next;
  reading_ = odometer_file_->next(next) ? std::optional(next) : std::nullopt;
}

void RunInputs::read_state() {
  if (!state_file_) return;
  TruckState next;
  state_ = state_file_->next(next) ? std::optional(next) : std::nullopt;
}

void RunInputs::read_head(HeadBeam& head) {
  head.is_there = false;
  while (!head.is_there) {
    const NextStatus status = head.scans->next(head.scan, std::chrono::milliseconds(100));
    if (status == NextStatus::kTimeout) continue;
    if (status != NextStatus::kFrame) return;
    head.is_there =
        head.scan.laser == head.beam.laser && sweep_of_scan(head.scan, head.beam, head.sweep);
  }
}

std::size_t RunInputs::next_head() const noexcept {
  std::size_t next = heads_.size();
  for (std::size_t i = 0; i < heads_.size(); ++i) {
    if (!heads_[i].is_there) continue;
    if (next == heads_.size() || heads_[i].sweep.time_s < heads_[next].sweep.time_s) next = i;
  }
  return next;
}

double RunInputs::next_s() const noexcept {
  const std::size_t head = next_head();
  double next_s = head < heads_.size() ? heads_[head].sweep.time_s : kNever;
  if (sweep_) next_s = std::min(next_s, sweep_->time_s);
  if (reading_) next_s = std::min(next_s, reading_->time_s);
  if (state_) next_s = std::min(next_s, state_->time_s);
  return next_s;
}

RunInput RunInputs::next() {
  const std::size_t head = next_head();
  HeadBeam* const next_head = head < heads_.size() ? &heads_[head] : nullptr;
  const double sweep_s = sweep_ ? sweep_->time_s : kNever;
  const double head_s = next_head != nullptr ? next_head->sweep.time_s : kNever;
  const double reading_s = reading_ ? reading_->time_s : kNever;
  const double state_s = state_ ? state_->time_s : kNever;
  // Of one time the odometer comes first: the others need it.
  if (reading_ && reading_s <= std::min({sweep_s, head_s, state_s})) {
    const OdometerReading reading = *reading_;
    read_odometer();
    return reading;
  }
  if (state_ && state_s <= std::min(sweep_s, head_s)) {
    const TruckState state = *state_;
    read_state();
    return state;
  }
  if (next_head == nullptr && !sweep_) return {};
  ++sweeps_;
  // The buffers change places: nothing is copied.
  if (next_head != nullptr && head_s < sweep_s) {
    std::swap(given_, next_head->sweep);
    read_head(*next_head);
  } else {
    std::swap(given_, *sweep_);
    read_sweep();
  }
  return &given_;
}

}  // namespace striper::program
