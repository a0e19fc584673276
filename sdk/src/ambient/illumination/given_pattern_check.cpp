// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/given_pattern_check.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "ambient/illumination/look_timer.hpp"
#include "ambient/illumination/pattern_rules.hpp"

namespace striper::detail {
namespace {

// Looks at a pattern that was given are twice as far apart each time, at most so often.
constexpr int kMostDoublings = 16;
constexpr std::size_t kLongestSeenInOneLook = 4;

constexpr const char* kNothingTellsApart =
    "nothing in the images tells its lit exposures from its dark ones: the laser is off, out of "
    "view, or on in all of them";

}  // namespace

std::optional<int> GivenPatternCheck::judge(const PatternFinder::Finding& finding,
                                            const PatternFinder& finder) {
  const IlluminationPattern before = std::exchange(otherwise_, {});
  const bool found = !finding.pattern.is_automatic();
  if (found && finder.tells_apart(finding.pattern, given_)) {
    const bool is_said_twice = !before.is_automatic() && agree(before, finding.pattern);
    if (finding.is_plain || is_said_twice) {
      contradict(finding.pattern);
    } else {
      otherwise_ = finding.pattern;
    }
  } else if (finding.always_lit && given_.has_dark()) {
    contradict("always_lit", "the laser shows in every image");
  } else if (found || finding.always_lit) {
    is_judged_ = true;
  } else if (finder.frames() >= PatternFinder::kFrames) {
    if (++unclear_looks_ == 2) say_that_nothing_tells_apart();
    // An empty street is not worth a look again and again.
    return LookTimer::kBetweenLooks << std::min(unclear_looks_ - 1, kMostDoublings);
  }
  return {};
}

void GivenPatternCheck::judge_at_end(bool is_looking, PatternFinder& finder) {
  IlluminationPattern other = otherwise_;
  if (is_looking && finder.exposures() > 1) {
    judge(finder.find(), finder);
    if (finder.frames() >= PatternFinder::kFrames) other = otherwise_;
  }
  if (is_judged_) return;
  if (!other.is_automatic()) return contradict(other);
  if (unclear_looks_ > 0) say_that_nothing_tells_apart();
}

void GivenPatternCheck::contradict(EventCode code, const std::string& what) {
  is_judged_ = true;
  events_.send_once(
      {code, fmt::format("the pattern '{}' was given, but {}", given_.to_string(), what)});
}

void GivenPatternCheck::contradict(const IlluminationPattern& shown) {
  contradict("pattern_contradicted", fmt::format("the images show '{}'", shown.to_string()));
}

// What a period is too long for, six frames do not show either.
void GivenPatternCheck::say_that_nothing_tells_apart() {
  const bool is_short = given_.entries().size() <= kLongestSeenInOneLook;
  if (given_.has_dark() && is_short) contradict("pattern_unseen", kNothingTellsApart);
}

}  // namespace striper::detail
