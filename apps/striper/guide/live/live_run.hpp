// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <striper/guidance/guidance.hpp>

#include "guide/live/live_heads.hpp"

namespace striper::program {

struct LiveRunOptions {
  std::vector<LiveHead> heads;
  std::filesystem::path output;   ///< The job's directory.
  std::filesystem::path record;   ///< What came in, as a recorded run; empty: not kept.
  std::optional<double> seconds;  ///< Ends then; else when it is told to, or all sources end.
  bool resumes = false;
};

/// `--head NAME=SOURCE` with `--model NAME=FILE`. @throws Error{kUsage} naming the word and what
/// was expected.
std::vector<LiveHead> live_heads(const std::vector<std::string>& heads,
                                 const std::vector<std::string>& models);

/// Guides a truck live, until told to stop.
///
/// Where nothing comes any more (a camera that is lost, a wire) the safe state is taken: guns off,
/// the safe voltage, which lateral.csv says in a line of state `fault`; when inputs come again it
/// goes on, with its totals. Where guidance wants lasers off they go off and stay off.
/// @return of this part of the job. @throws Error as `LiveHeads`, `JobTotals` and `RunTables` do.
GuidanceTotals run_live(const GuidanceConfig& config, const LiveRunOptions& options);

}  // namespace striper::program
