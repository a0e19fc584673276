// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper::detail {

/// When the pattern is looked for in the images: from now on, or after so many exposures.
class LookTimer {
 public:
  // Exposures between two checks of a pattern that was found, or of a scene that showed no stripe:
  // 8 s and half a second of a camera at 30/s.
  static constexpr int kBetweenChecks = 250;
  static constexpr int kBetweenLooks = 12;

  bool is_looking() const noexcept { return is_looking_; }

  void look_now() noexcept { is_looking_ = true; }
  void look_now_and_on() noexcept {
    is_looking_ = true;
    until_next_ = 0;
  }
  void look_after(int exposures) noexcept { until_next_ = exposures; }
  void stop_looking() noexcept { is_looking_ = false; }

  /// Counts an exposure that was not looked at.
  void count() noexcept {
    if (until_next_ > 0 && --until_next_ == 0) is_looking_ = true;
  }

 private:
  bool is_looking_ = true;
  int until_next_ = 0;
};

}  // namespace striper::detail
