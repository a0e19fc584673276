// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include <striper/guidance/guidance.hpp>

namespace striper::program {

/// Whether lasers may fire.
enum class LaserState {
  kOff,     ///< Not yet, or no more.
  kOn,      ///< Guidance runs.
  kLocked,  ///< Guidance had them switched off: only a new start lets them fire again.
};
/// `off`, `on`, `locked`. Static storage.
std::string_view to_string(LaserState state) noexcept;

/// What a job comes to over all its parts: a program that ends, or is ended, in the middle goes on
/// from there. `job.json` in the job's directory.
class JobTotals {
 public:
  /// @param resumes the file is read; else the job begins.
  /// @throws Error{kNotFound, kBadFile} naming the file.
  JobTotals(const std::filesystem::path& directory, bool resumes);

  int part() const noexcept { return part_; }  ///< 1 is the first.
  /// Whether lasers were locked when the part before ended.
  bool was_locked() const noexcept { return was_locked_; }
  /// Where this part's tables go: the job's directory, later parts in `part-N` of it.
  std::filesystem::path tables() const;

  /// Where they are kept, and what that file says of the parts before and this one.
  std::filesystem::path file() const { return directory_ / "job.json"; }
  std::string text(const GuidanceTotals& now, LaserState laser) const;

  struct Gun {
    double on_m = 0.0;
    std::uint64_t dashes = 0;
  };
  double way_m() const noexcept { return way_m_; }  ///< Of the parts before.
  const std::map<std::string, Gun>& guns() const noexcept { return guns_; }

 private:
  std::filesystem::path directory_;
  int part_ = 1;
  bool was_locked_ = false;
  double way_m_ = 0.0;
  std::uint64_t scans_ = 0;
  std::uint64_t faults_ = 0;
  std::map<std::string, Gun> guns_;
};

}  // namespace striper::program
