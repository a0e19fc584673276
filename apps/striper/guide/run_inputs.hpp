// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/guidance/guidance.hpp>
#include <striper/stream/scan_source.hpp>

namespace striper::program {

/// The inputs of a recorded run, in the order of time: sweeps.csv and the scans of heads,
/// odometer.csv, state.csv.
class RunInputs {
 public:
  /// @throws Error{kNotFound, kBadFile, kIo} naming the file and what was expected.
  RunInputs(const std::filesystem::path& directory, const GuidanceConfig& config,
            const EventPort& events);

  /// When the next one is of; infinite at the end.
  double next_s() const noexcept;
  /// Gives the next one to guidance. @return false at the end.
  bool give_next(Guidance& guidance);

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
  std::optional<OdometerReading> reading_;
  std::optional<TruckState> state_;
  std::uint64_t sweeps_ = 0;
};

}  // namespace striper::program
