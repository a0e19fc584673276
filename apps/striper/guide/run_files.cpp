// SPDX-License-Identifier: Apache-2.0
#include "guide/run_files.hpp"

#include <algorithm>
#include <array>
#include <system_error>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::program {
namespace {

namespace fs = std::filesystem;

constexpr std::array kOfRun{"guidance.yaml", "sweeps.csv", "odometer.csv", "state.csv",
                            "truth.csv",     "tape.csv",   "volts.csv",    "painted.csv"};
constexpr std::array kOfJob{"lateral.csv", "guns.csv",      "seen.csv",
                            "faults.csv",  "guidance.yaml", "job.json"};

// By what only a run has.
bool holds_run(const fs::path& directory) {
  return fs::exists(directory / "sweeps.csv") || fs::exists(directory / "odometer.csv");
}

}  // namespace

std::vector<fs::path> run_files(const fs::path& run, const GuidanceConfig& config) {
  std::vector<fs::path> files;
  files.reserve(kOfRun.size() + 2 * config.beams.size());
  for (const char* name : kOfRun) files.push_back(run / name);
  for (const GuidanceBeam& beam : config.beams) {
    if (beam.head.empty()) continue;
    for (const char* ending : {".mcap", ".csv"}) files.push_back(run / (beam.head + ending));
  }
  return files;
}

std::vector<fs::path> job_files(const fs::path& job) {
  std::vector<fs::path> files;
  files.reserve(kOfJob.size());
  for (const char* name : kOfJob) files.push_back(job / name);
  return files;
}

bool is_same_file(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  if (fs::exists(a, ignored) && !fs::is_regular_file(a, ignored)) return false;
  if (fs::equivalent(a, b, ignored)) return true;
  return fs::weakly_canonical(a, ignored) == fs::weakly_canonical(b, ignored);
}

void make_directory(const fs::path& directory) {
  std::error_code failure;
  fs::create_directories(directory, failure);
  if (!failure) return;
  throw Error(ErrorKind::kIo,
              fmt::format("cannot make '{}': {}", directory.string(), failure.message()),
              failure.value());
}

void make_run_directory(const fs::path& run) {
  make_directory(run);
  if (!holds_run(run)) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("'{}' already holds a run: name another directory, or remove it first",
                          run.string()));
}

void require_free_for_job(const fs::path& job) {
  if (holds_run(job)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("-o {} names a run: its guidance.yaml would be replaced - name another "
                            "directory",
                            job.string()));
  }
  if (!fs::exists(job / "job.json")) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("-o {} holds a job that was driven - name another directory, or go on "
                          "with it live (--head, --resume)",
                          job.string()));
}

}  // namespace striper::program
