// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <striper/guidance/guidance.hpp>
#include <striper/stream/rig_file.hpp>

#include "guide/live/job_totals.hpp"
#include "guide/live/live_heads.hpp"

namespace striper::program {

struct LiveRunOptions {
  std::vector<LiveHead> heads;
  std::filesystem::path output;   ///< The job's directory.
  std::filesystem::path record;   ///< What came in, as a recorded run; empty: not kept.
  std::vector<std::string> to;    ///< As `GuidanceOutputs` has them.
  std::optional<double> seconds;  ///< Ends then; else when it is told to, or all sources end.
  bool resumes = false;
  std::vector<std::filesystem::path> taken;  ///< Files that no output may be.
};

/// What this part of the job has come to.
struct LiveOutcome {
  GuidanceTotals totals;
  LaserState laser = LaserState::kOff;
  bool is_all_sent = true;  ///< Nothing that was to go somewhere was lost.
};

/// `--head NAME=SOURCE` with `--model NAME=FILE`. @throws Error{kUsage} naming the word and what
/// was expected.
std::vector<LiveHead> live_heads(const std::vector<std::string>& heads,
                                 const std::vector<std::string>& models);
/// The heads of a rig.
std::vector<LiveHead> live_heads(const RigFile& rig);

/// Takes the rig's odometer where the truck's file names no source. @throws Error{kUsage} where the
/// two disagree about the counter.
void take_odometer(const RigFile& rig, const std::string& file, GuidanceConfig& config);

/// Guides a truck live, until told to stop.
///
/// Where nothing comes any more (a camera that is lost, a wire) the safe state is taken: guns off,
/// the safe voltage, which lateral.csv and every output say in a line of state `fault`; when inputs
/// come again it goes on, with its totals. Where guidance wants lasers off they go off and stay
/// off. However it ends, guns are off first.
/// @throws Error as `LiveHeads`, `JobTotals`, `GuidanceOutputs` and `RunTables` do; {kUsage} where
/// there is a job or a run already.
LiveOutcome run_live(const GuidanceConfig& config, const LiveRunOptions& options);

}  // namespace striper::program
