// SPDX-License-Identifier: Apache-2.0
#include "guide/run_tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "program/terminal.hpp"

namespace striper::program {

RunTables::RunTables(const std::filesystem::path& directory)
    : lateral_((directory / "lateral.csv").string(), lateral_columns()),
      guns_((directory / "guns.csv").string(), gun_columns()),
      seen_((directory / "seen.csv").string(), seen_columns()),
      faults_((directory / "faults.csv").string(), fault_columns()) {}

void RunTables::fault(const FaultLine& line) {
  faults_.add(line);
  constexpr int kMost = 10;
  if (++said_ > kMost) return;
  say(fmt::format("fault at {:.3f} s: {}; {}", line.time_s, to_string(line.code),
                  to_string(line.action)));
}

void RunTables::flush() {
  lateral_.flush();
  guns_.flush();
  seen_.flush();
  faults_.flush();
}

void RunTables::close() {
  lateral_.close();
  guns_.close();
  seen_.close();
  faults_.close();
}

nlohmann::json json_of(const GuidanceTotals& totals, const GuidanceStripe& stripe) {
  nlohmann::json json{{"sweeps", totals.sweeps},
                      {"sweeps_of_unknown_beams", totals.unknown_sweeps},
                      {"scans", totals.scans},
                      {"way_m", totals.way_m},
                      {"longest_gap_m", totals.longest_gap_m},
                      {"gap_limit_m", stripe.gap_limit_m},
                      {"dashes_lost", totals.dashes_lost},
                      {"dashes_not_allowed", totals.dashes_not_allowed}};
  constexpr std::array kStates{"tracking", "bridging", "lost", "fault"};
  for (std::size_t i = 0; i < kStates.size(); ++i) {
    json["scans_of_state"][kStates[i]] = totals.scans_of_state[i];
  }
  json["guns"] = nlohmann::json::array();
  for (const GuidanceTotals::Gun& gun : totals.guns) {
    nlohmann::json one{{"name", gun.name}, {"on_m", gun.on_m}, {"dashes", gun.dashes}};
    if (std::isfinite(gun.cycle_m)) {
      one["pattern"] = {{"dash_m", gun.dash_m},
                        {"gap_m", gun.cycle_m - gun.dash_m},
                        {"quality", gun.pattern_quality}};
    }
    json["guns"].push_back(one);
  }
  for (std::size_t i = 0; i < kSeenKinds; ++i) {
    json["seen"][std::string(to_string(static_cast<SeenKind>(i)))] = totals.seen[i];
  }
  for (std::size_t i = 0; i < kGuidanceFaults; ++i) {
    json["faults"][std::string(to_string(static_cast<GuidanceFault>(i)))] = totals.faults[i];
  }
  return json;
}

void say_totals(const GuidanceTotals& totals, const GuidanceStripe& stripe) {
  const auto share = [&](PathState state) {
    return 100.0 * static_cast<double>(totals.scans_of_state[static_cast<std::size_t>(state)]) /
           static_cast<double>(std::max<std::uint64_t>(totals.scans, 1));
  };
  say(
      fmt::format("{:.1f} m in {}; the stripe tracked in {:.1f} %, bridged in {:.1f} %, lost in "
                  "{:.1f} %, faults in {:.1f} %",
                  totals.way_m, count(totals.scans, "scan"), share(PathState::kTracking),
                  share(PathState::kBridging), share(PathState::kLost), share(PathState::kFault)));
  say(fmt::format("longest gap: {:.2f} m of at most {:.2f} m", totals.longest_gap_m,
                  stripe.gap_limit_m));
  for (const GuidanceTotals::Gun& gun : totals.guns) {
    std::string text =
        fmt::format("{}: {:.2f} m painted, switched on {} times", gun.name, gun.on_m, gun.dashes);
    if (std::isfinite(gun.cycle_m)) {
      text += fmt::format("; a pattern of {:.2f} m and {:.2f} m gap", gun.dash_m,
                          gun.cycle_m - gun.dash_m);
    }
    say(text);
  }
  std::string seen;
  for (const SeenKind kind : {SeenKind::kMarker, SeenKind::kTape, SeenKind::kSpot, SeenKind::kCross,
                              SeenKind::kLetter, SeenKind::kWet}) {
    const auto number = totals.seen[static_cast<std::size_t>(kind)];
    if (number > 0)
      seen += fmt::format("{}{} {}", seen.empty() ? "" : ", ", number, to_string(kind));
  }
  if (!seen.empty()) say("no stripe: " + seen);
  constexpr double kBackwards_m = -1.0;
  if (totals.way_m < kBackwards_m) {
    say("by its odometer the truck went backwards: is the sign of counts_per_m right?");
  }
  if (totals.unknown_sweeps > 0) {
    say(fmt::format("{} of beams that guidance.yaml does not name",
                    count(totals.unknown_sweeps, "sweep")));
  }
}

}  // namespace striper::program
