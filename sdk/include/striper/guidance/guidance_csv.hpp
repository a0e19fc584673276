// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include <striper/core/csv_table.hpp>
#include <striper/guidance/guidance_config.hpp>

namespace striper {

/// Whether the path can be steered by.
enum class PathState {
  kTracking,
  kBridging,  ///< In a gap: predicted, its sigma grows.
  kLost,      ///< Never seen, or not for longer than the gap limit.
  kFault,     ///< A fault stops or holds.
};

/// A line of `lateral.csv`: where the followed line is at the gun, once a scan.
struct LateralLine {
  double time_s = 0.0;
  std::int64_t odometer_counts = 0;
  double distance_m = 0.0;  ///< Of the gun's reference, from the first count.
  double lateral_m = std::numeric_limits<double>::quiet_NaN();
  double sigma_m = std::numeric_limits<double>::quiet_NaN();  ///< None of the report's methods.
  double volts = 0.0;
  int beams = 0;  ///< That saw it in this scan.
  PathState state = PathState::kLost;
};

/// A line of `guns.csv`: a stretch through which a gun's signal stayed (Appendix C).
struct GunLine {
  std::string gun;
  bool is_on = false;
  std::int64_t from_counts = 0;
  std::int64_t to_counts = 0;
  double from_m = 0.0;
  double to_m = 0.0;
  double length_m = 0.0;
  double total_m = 0.0;  ///< This length and the one before.
};

enum class SeenKind { kStart, kEnd, kMarker, kTape, kSpot, kCross, kLetter, kWet, kLine };
inline constexpr std::size_t kSeenKinds = 9;
std::string_view to_string(SeenKind kind) noexcept;

/// A line of `seen.csv`: what a beam saw, and why it was taken for that.
struct SeenLine {
  double time_s = 0.0;
  std::int64_t odometer_counts = 0;
  double distance_m = 0.0;  ///< Where it is on the road: where it begins, for what has a length.
  std::string beam;
  SeenKind kind = SeenKind::kLine;
  double lateral_m = 0.0;
  double length_m = std::numeric_limits<double>::quiet_NaN();
  std::string reason;
};

/// A line of `faults.csv`: a fault that began.
struct FaultLine {
  double time_s = 0.0;
  GuidanceFault code = GuidanceFault::kNoStripe;
  FaultAction action = FaultAction::kWarn;
  double latency_s = 0.0;  ///< From when it could be known.
};

/// A line of `state.csv`: what the scanner says of itself.
struct TruckState {
  double time_s = 0.0;
  int laser = 1;
  double mirror_hz = std::numeric_limits<double>::quiet_NaN();
};

/// A line of `truth.csv`, one every centimetre.
struct RoadTruth {
  double distance_m = 0.0;
  double lateral_m = 0.0;  ///< Of line 0 at the gun, as it was painted once.
  int line0 = 0;           ///< Whether paint is there.
  int line1 = 0;
};

// The tables' columns, as section "Guidance" of CONVENTIONS.md names them.
std::span<const CsvColumn<LateralLine>> lateral_columns();
std::span<const CsvColumn<GunLine>> gun_columns();
std::span<const CsvColumn<SeenLine>> seen_columns();
std::span<const CsvColumn<FaultLine>> fault_columns();
std::span<const CsvColumn<TruckState>> truck_state_columns();
std::span<const CsvColumn<RoadTruth>> road_truth_columns();

}  // namespace striper
