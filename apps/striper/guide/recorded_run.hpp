// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <striper/guidance/guidance.hpp>

namespace striper::program {

struct RecordedRunOptions {
  std::filesystem::path run;
  std::filesystem::path output;              ///< The job's directory; it is made.
  std::vector<std::string> to;               ///< As `GuidanceOutputs` has them.
  std::vector<std::filesystem::path> taken;  ///< Files that no output may be, beside run and job.
};

/// What a run has come to.
struct RunOutcome {
  GuidanceTotals totals;
  bool is_all_sent = true;  ///< Nothing that was to go somewhere was lost.
  bool was_interrupted = false;
};

/// Guides over what a truck has recorded, to tables and outputs; at its own pace where one of them
/// is a bus. @throws Error as `RunInputs`, `GuidanceOutputs` and `RunTables` do; {kUsage} where the
/// tables would replace a run or a job that was driven.
RunOutcome run_recorded(const GuidanceConfig& config, const RecordedRunOptions& options);

}  // namespace striper::program
