// SPDX-License-Identifier: Apache-2.0
#include <array>

#include <striper/guidance/guidance_csv.hpp>

namespace striper {
namespace {

constexpr std::array kStateWords{CsvWord<PathState>{PathState::kTracking, "tracking"},
                                 CsvWord<PathState>{PathState::kBridging, "bridging"},
                                 CsvWord<PathState>{PathState::kLost, "lost"},
                                 CsvWord<PathState>{PathState::kFault, "fault"}};
constexpr std::array kSignalWords{CsvWord<bool>{true, "ON"}, CsvWord<bool>{false, "OFF"}};
constexpr std::array kSeenWords{
    CsvWord<SeenKind>{SeenKind::kStart, "start"},   CsvWord<SeenKind>{SeenKind::kEnd, "end"},
    CsvWord<SeenKind>{SeenKind::kMarker, "marker"}, CsvWord<SeenKind>{SeenKind::kTape, "tape"},
    CsvWord<SeenKind>{SeenKind::kSpot, "spot"},     CsvWord<SeenKind>{SeenKind::kCross, "cross"},
    CsvWord<SeenKind>{SeenKind::kLetter, "letter"}, CsvWord<SeenKind>{SeenKind::kWet, "wet"},
    CsvWord<SeenKind>{SeenKind::kLine, "line"}};
constexpr std::array kActionWords{CsvWord<FaultAction>{FaultAction::kStop, "stop"},
                                  CsvWord<FaultAction>{FaultAction::kHold, "hold"},
                                  CsvWord<FaultAction>{FaultAction::kWarn, "warn"}};
constexpr std::array kFaultWords{CsvWord<GuidanceFault>{GuidanceFault::kNoStripe, "no_stripe"},
                                 CsvWord<GuidanceFault>{GuidanceFault::kBeamSilent, "beam_silent"},
                                 CsvWord<GuidanceFault>{GuidanceFault::kBeamBlind, "beam_blind"},
                                 CsvWord<GuidanceFault>{GuidanceFault::kOdometer, "odometer"},
                                 CsvWord<GuidanceFault>{GuidanceFault::kMirror, "mirror"},
                                 CsvWord<GuidanceFault>{GuidanceFault::kLaserOff, "laser_off"},
                                 CsvWord<GuidanceFault>{GuidanceFault::kTime, "time"},
                                 CsvWord<GuidanceFault>{GuidanceFault::kQueueFull, "queue_full"}};

// NOLINTBEGIN(bugprone-macro-parentheses): a lambda.
#define STRIPER_CELL(member) \
  [](auto& r) -> auto& { return r.member; }
// NOLINTEND(bugprone-macro-parentheses)

constexpr std::array kLateralColumns{
    csv_column<LateralLine>("time_s", STRIPER_CELL(time_s), CsvNeed::kRequired),
    csv_column<LateralLine>("odometer_counts", STRIPER_CELL(odometer_counts)),
    csv_column<LateralLine>("distance_m", STRIPER_CELL(distance_m), CsvNeed::kRequired),
    csv_column<LateralLine>("lateral_m", STRIPER_CELL(lateral_m), CsvNeed::kRequired),
    csv_column<LateralLine>("sigma_m", STRIPER_CELL(sigma_m)),
    csv_column<LateralLine>("volts", STRIPER_CELL(volts)),
    csv_column<LateralLine>("beams", STRIPER_CELL(beams)),
    csv_column<LateralLine>("state",
                            [](auto& r) {
                              return CsvWords{r.state, kStateWords};
                            }),
};
constexpr std::array kGunColumns{
    csv_column<GunLine>("gun", STRIPER_CELL(gun)),
    csv_column<GunLine>(
        "state",
        [](auto& r) {
          return CsvWords{r.is_on, kSignalWords};
        },
        CsvNeed::kRequired),
    csv_column<GunLine>("from_counts", STRIPER_CELL(from_counts)),
    csv_column<GunLine>("to_counts", STRIPER_CELL(to_counts)),
    csv_column<GunLine>("from_m", STRIPER_CELL(from_m), CsvNeed::kRequired),
    csv_column<GunLine>("to_m", STRIPER_CELL(to_m), CsvNeed::kRequired),
    csv_column<GunLine>("length_m", STRIPER_CELL(length_m)),
    csv_column<GunLine>("total_m", STRIPER_CELL(total_m)),
};
constexpr std::array kSeenColumns{
    csv_column<SeenLine>("time_s", STRIPER_CELL(time_s)),
    csv_column<SeenLine>("odometer_counts", STRIPER_CELL(odometer_counts)),
    csv_column<SeenLine>("distance_m", STRIPER_CELL(distance_m)),
    csv_column<SeenLine>("beam", STRIPER_CELL(beam)),
    csv_column<SeenLine>("kind",
                         [](auto& r) {
                           return CsvWords{r.kind, kSeenWords};
                         }),
    csv_column<SeenLine>("lateral_m", STRIPER_CELL(lateral_m)),
    csv_column<SeenLine>("length_m", STRIPER_CELL(length_m)),
    csv_column<SeenLine>("reason", STRIPER_CELL(reason)),
};
constexpr std::array kFaultColumns{
    csv_column<FaultLine>("time_s", STRIPER_CELL(time_s)),
    csv_column<FaultLine>("code",
                          [](auto& r) {
                            return CsvWords{r.code, kFaultWords};
                          }),
    csv_column<FaultLine>("action",
                          [](auto& r) {
                            return CsvWords{r.action, kActionWords};
                          }),
    csv_column<FaultLine>("latency_s", STRIPER_CELL(latency_s)),
};
constexpr std::array kTruckStateColumns{
    csv_column<TruckState>("time_s", STRIPER_CELL(time_s), CsvNeed::kRequired),
    csv_column<TruckState>("laser", STRIPER_CELL(laser)),
    csv_column<TruckState>("mirror_hz", STRIPER_CELL(mirror_hz)),
};
constexpr std::array kRoadTruthColumns{
    csv_column<RoadTruth>("distance_m", STRIPER_CELL(distance_m), CsvNeed::kRequired),
    csv_column<RoadTruth>("lateral_m", STRIPER_CELL(lateral_m), CsvNeed::kRequired),
    csv_column<RoadTruth>("line0", STRIPER_CELL(line0)),
    csv_column<RoadTruth>("line1", STRIPER_CELL(line1)),
};

#undef STRIPER_CELL

}  // namespace

std::string_view to_string(SeenKind kind) noexcept {
  return kSeenWords[static_cast<std::size_t>(kind)].text;
}

std::span<const CsvColumn<LateralLine>> lateral_columns() { return kLateralColumns; }
std::span<const CsvColumn<GunLine>> gun_columns() { return kGunColumns; }
std::span<const CsvColumn<SeenLine>> seen_columns() { return kSeenColumns; }
std::span<const CsvColumn<FaultLine>> fault_columns() { return kFaultColumns; }
std::span<const CsvColumn<TruckState>> truck_state_columns() { return kTruckStateColumns; }
std::span<const CsvColumn<RoadTruth>> road_truth_columns() { return kRoadTruthColumns; }

}  // namespace striper
