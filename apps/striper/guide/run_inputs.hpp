// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/guidance/guidance.hpp>
#include <striper/stream/scan_source.hpp>

namespace striper::program {

/// One of them; a sweep is valid until the next is asked for.
using RunInput = std::variant<std::monostate, OdometerReading, TruckState, const BeamSweep*>;

/// The inputs of a recorded run, in the order of time: sweeps.csv and the scans of heads,
/// odometer.csv, state.csv.
class RunInputs {
 public:
  /// @throws Error{kNotFound, kBadFile, kIo} naming the file and what was expected.
  RunInputs(const std::filesystem::path& directory, const GuidanceConfig& config,
            const EventPort& events);

  /// When the next one is of; infinite at the end.
  double next_s() const noexcept;
  /// The next one; the first of the alternatives at the end.
  RunInput next();

  /// Gives the next one to what has a `take` for it; for the truck's state it need not have one.
  /// @return false at the end.
  template <typename Taker>
  bool give_next(Taker& taker) {
    const RunInput input = next();
    if (const auto* reading = std::get_if<OdometerReading>(&input)) taker.take(*reading);
    if constexpr (requires(TruckState state) { taker.take(state); }) {
      if (const auto* state = std::get_if<TruckState>(&input)) taker.take(*state);
    }
    if (const auto* sweep = std::get_if<const BeamSweep*>(&input)) taker.take(**sweep);
    return input.index() != 0;
  }

  std::uint64_t sweeps() const noexcept { return sweeps_; }

 private:
  // The scans of one head, for one beam.
  struct HeadBeam {
    GuidanceBeam beam;
    std::unique_ptr<ScanSource> scans;
    PolarScan scan;
    BeamSweep sweep;
    bool is_there = false;
  };
  void read_sweep();
  void read_odometer();
  void read_state();
  void read_head(HeadBeam& head);
  std::size_t next_head() const noexcept;  // Its index; their number where none has any.

  std::optional<SweepReader> sweep_file_;
  std::optional<CsvReader<OdometerReading>> odometer_file_;
  std::optional<CsvReader<TruckState>> state_file_;
  std::vector<HeadBeam> heads_;
  std::optional<BeamSweep> sweep_;
  BeamSweep given_;
  std::optional<OdometerReading> reading_;
  std::optional<TruckState> state_;
  std::uint64_t sweeps_ = 0;
};

}  // namespace striper::program
