// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <striper/core/event.hpp>
#include <striper/core/illumination_pattern.hpp>

#include "ambient/illumination/pattern_finder.hpp"
#include "core/once_events.hpp"

namespace striper::detail {

/// Asks the images whether they show the pattern that was given, until they confirm or refute it:
/// at once where they do so plainly, else when they say the same twice. It is followed whatever
/// they show; what they show is said.
class GivenPatternCheck {
 public:
  /// @param given outlives this, as `events` does.
  GivenPatternCheck(const IlluminationPattern& given, OnceEvents& events)
      : given_(given), events_(events) {}

  /// Takes what a look at the images found.
  /// @return exposures until the next look, where nothing was to be seen.
  std::optional<int> judge(const PatternFinder::Finding& finding, const PatternFinder& finder);

  /// There may have been frames for one look only, or for less.
  /// @param is_looking whether frames were collected that were not judged yet.
  void judge_at_end(bool is_looking, PatternFinder& finder);

  /// Less than plainly they showed another one, and are asked again.
  bool is_to_be_confirmed() const noexcept { return !otherwise_.is_automatic(); }

 private:
  void contradict(EventCode code, const std::string& what);
  void contradict(const IlluminationPattern& shown);
  void say_that_nothing_tells_apart();

  const IlluminationPattern& given_;
  OnceEvents& events_;
  IlluminationPattern otherwise_;  // Another one, less than plainly.
  int unclear_looks_ = 0;
  bool is_judged_ = false;  // Confirmed or refuted.
};

}  // namespace striper::detail
