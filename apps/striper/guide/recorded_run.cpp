// SPDX-License-Identifier: Apache-2.0
#include "guide/recorded_run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>

#include "guide/guidance_outputs.hpp"
#include "guide/run_files.hpp"
#include "guide/run_inputs.hpp"
#include "guide/run_tables.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

// Waits until an input is due, of a run that began when this was made; less where it is to stop.
class RunPace {
 public:
  void wait_for(double time_s) {
    if (!std::isfinite(time_s)) return;
    if (std::isnan(first_s_)) first_s_ = time_s;
    const auto due = begin_ + std::chrono::duration_cast<Clock::duration>(
                                  std::chrono::duration<double>(time_s - first_s_));
    while (!stop_requested() && Clock::now() < due) {
      std::this_thread::sleep_until(std::min(due, Clock::now() + kLongest));
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kLongest{50};

  Clock::time_point begin_ = Clock::now();
  double first_s_ = std::numeric_limits<double>::quiet_NaN();
};

void play(RunInputs& inputs, Guidance& guidance, bool is_live) {
  Progress progress("sweeps", std::nullopt);
  RunPace pace;
  while (!stop_requested()) {
    if (is_live) pace.wait_for(inputs.next_s());
    if (!inputs.give_next(guidance)) break;
    progress.update(inputs.sweeps());
  }
}

GuidanceOutputs::Options output_options(const GuidanceConfig& config,
                                        const RecordedRunOptions& options) {
  GuidanceOutputs::Options outputs;
  outputs.taken = options.taken;
  for (const auto& files : {run_files(options.run, config), job_files(options.output)}) {
    outputs.taken.insert(outputs.taken.end(), files.begin(), files.end());
  }
  return outputs;
}

// What ended the run is said by whoever catches it.
void keep_what_there_is(RunTables& tables, const fs::path& output) {
  try {
    tables.close();
    say(fmt::format("the tables in {} hold what was guided until then", output.string()));
  } catch (const Error& error) {
    say(error.what());
  }
}

}  // namespace

RunOutcome run_recorded(const GuidanceConfig& config, const RecordedRunOptions& options) {
  const TerminalEvents events;
  require_free_for_job(options.output);
  RunInputs inputs(options.run, config, events.port());
  // Before the tables of an earlier job go.
  GuidanceOutputs outputs(options.to, config, output_options(config, options));
  make_directory(options.output);
  RunTables tables(options.output);
  outputs.add(tables);
  Guidance guidance(config, outputs);
  try {
    play(inputs, guidance, outputs.is_live());
  } catch (...) {
    keep_what_there_is(tables, options.output);
    throw;
  }
  RunOutcome outcome;
  outcome.was_interrupted = stop_requested();
  guidance.finish();
  outcome.is_all_sent = outputs.finish();
  tables.close();
  write_file_atomically(options.output / "guidance.yaml", format_guidance(config));
  outcome.totals = guidance.totals();
  return outcome;
}

}  // namespace striper::program
