// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include <striper/guidance/guidance_config.hpp>

namespace striper::program {

/// The files that a run may have (CONVENTIONS.md, "Guidance").
std::vector<std::filesystem::path> run_files(const std::filesystem::path& run,
                                             const GuidanceConfig& config);
/// The files that a job's directory gets.
std::vector<std::filesystem::path> job_files(const std::filesystem::path& job);

/// Whether both name one file that is regular or not there yet: a device or a pipe may be written
/// twice.
bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// With those above it; it may be there. @throws Error{kIo}.
void make_directory(const std::filesystem::path& directory);

/// Makes the directory of a new run. @throws Error{kUsage} where it holds one, Error{kIo}.
void make_run_directory(const std::filesystem::path& run);

/// That tables may go there: it is no run, whose guidance.yaml would be replaced, and no job that a
/// truck has driven. @throws Error{kUsage} naming it and what to do.
void require_free_for_job(const std::filesystem::path& job);

}  // namespace striper::program
