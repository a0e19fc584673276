// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/detect/curb_detector.hpp>
#include <striper/motion/motion.hpp>
#include <striper/scan/polar_scan.hpp>
#include <striper/stream/scan_bus.hpp>

#include "options/range_sigmas.hpp"
#include "program/command.hpp"

namespace striper::program {

/// The options of every command that tracks something from scan to scan: `objects`, `curb`.
struct FollowArguments {
  std::string scans;
  std::optional<std::string> model;
  std::optional<std::string> output;
  std::vector<std::string> sinks;
  std::optional<std::string> plot;
  std::uint64_t frames = std::numeric_limits<std::uint64_t>::max();
  double sigma_m = kNoSigma_m;
  std::optional<double> up_deg;
  std::optional<std::string> odometer;
  double speed_m_s = CurbDetectorOptions{}.speed_m_s;  ///< Where there is no odometer.
  double counts_per_m = std::numeric_limits<double>::quiet_NaN();
  bool json = false;

  std::optional<double> up_rad() const;
  /// Where the table goes; none with --json alone.
  std::optional<std::string> table() const;
};

/// `SCANS`, `--model`, `--output`, `--to`, `--plot`, `--frames`, `--sigma`, `--up`, `--speed`,
/// `--odometer`, `--counts-per-m`, `--json`. @return the option `--odometer`, for what needs it.
CommandOption* add_follow_arguments(Command& command, FollowArguments& arguments);

/// Refuses files that are read, written twice or of another kind, before anything is opened.
/// @throws Error naming the file.
void require_files(const FollowArguments& arguments);

struct FollowCounts {
  std::uint64_t scans = 0;
  std::uint64_t without_motion = 0;  ///< Scans of which the odometer says nothing.
};

/// A scan and what comes with it.
struct FollowedScan {
  const PolarScan& scan;
  const std::optional<Motion>& motion;  ///< Of the vehicle; none where nothing says.
  ScanBus& bus;                         ///< Whoever --to names: they have the scan already.
  const EventPort& events;              ///< The terminal, and whoever --to names.
};

/// Gives every scan, until they end or the program is told to: ranges without a sigma have that of
/// --sigma; with an odometer the vehicle's motion at the scan's time.
/// What --to names gets the scans, what `take` puts on the bus, and all events.
/// @throws Error{kBadFile} where there is no scan, or the odometer is of another time,
/// Error{kUsage} where no range says how good it is.
FollowCounts follow_scans(const FollowArguments& arguments, const EventPort& events,
                          const std::function<void(const FollowedScan&)>& take);

/// Writes the plot where one is asked for, and says which files are there now.
/// @throws Error{kIo}.
void write_plot(const FollowArguments& arguments, const std::function<std::string()>& svg);

}  // namespace striper::program
