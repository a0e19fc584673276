// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <striper/core/illumination_pattern.hpp>
#include <striper/gige/gige_options.hpp>

#include "gige/protocol/feature_access.hpp"

namespace striper::detail {

/// Drives the lasers through the camera's output lines: a line that fires its laser carries
/// ExposureActive, so the light is on while the shutter is open and never longer; one that does not
/// is off: its source is Off or, in a camera that has no such source, a user output that is low.
/// Which one fires in which exposure is the sequencer's work or, exposure by exposure, the
/// host's.
class LaserLines {
 public:
  /// Checks that the camera has the lines and a way to switch them, and turns them off.
  /// @throws Error{kUnsupported} naming the feature that is missing, Error{kUsage} quoting a line
  /// that does not exist with those that do.
  LaserLines(const FeatureAccess& features, const GigeOptions& options);

  bool is_used() const noexcept { return !lines_.empty(); }
  /// The host must call `command` before each exposure, and trigger it.
  bool is_host_switched() const noexcept { return method_ == Method::kHost; }

  /// Turns all lasers off: every line is written, whatever becomes of the others.
  /// @throws Error{kDevice} the first that the camera did not obey.
  void off();
  /// The same for the way out: true if the camera obeyed.
  bool try_off() noexcept;

  /// Makes the lasers follow the pattern from the next acquisition start on. With a host-switched
  /// pattern they stay off until `command`.
  void arm();

  /// Has exactly this laser fire in the next exposures. Precondition: `is_host_switched()`.
  void command(Illumination light);

  /// What the lasers do in exposure `n` after acquisition start; unknown where they are not ours or
  /// host-switched.
  Illumination at(std::uint64_t n) const noexcept;

  /// Turns on the chunk that reports the lines with each frame, if the camera has it.
  bool enable_line_chunk();

  /// What fired, from the lines' state that came with the frame.
  Illumination from_line_status(std::int64_t status_all) const noexcept;

 private:
  enum class Method { kNone, kConstant, kSequencer, kHost };

  void require_no_bracket(const std::string& uri) const;
  void add_line(const std::string& line);
  void make_output(const std::string& line) const;
  std::string find_dark_source(const std::string& line) const;
  void choose_method(const GigeOptions& options);
  void put(std::size_t line, bool fires);
  void program_sequencer();

  const FeatureAccess& features_;
  IlluminationPattern pattern_;
  std::vector<std::string> lines_;
  std::vector<std::string> dark_sources_;
  std::vector<std::optional<int>> line_bits_;  // In LineStatusAll.
  std::vector<bool> fires_;
  Method method_ = Method::kNone;
};

}  // namespace striper::detail
