// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace striper::program {

/// Which tracks are certain, so that each is said once when it is found and once when it is
/// gone. Each head's and laser's tracks have numbers of their own.
class FoundTracks {
 public:
  /// Found is what is there with this probability: the third hit in a row makes an object .9, a
  /// metre of way a curb.
  static constexpr double kSure = 0.9;

  using Plane = std::pair<std::string, int>;

  /// What changed by a track at the plane's next scan. @return true where it is found just now.
  bool see(const Plane& plane, std::uint64_t track, double confidence) {
    const auto known = found_.find({plane, track});
    if (known != found_.end()) known->second = true;
    if (known != found_.end() || confidence < kSure) return false;
    found_[{plane, track}] = true;
    ++count_;
    return true;
  }

  /// Calls `gone(track)` for each found track of the plane that was not seen since the last call.
  template <typename Gone>
  void forget_unseen(const Plane& plane, const Gone& gone) {
    for (auto one = found_.begin(); one != found_.end();) {
      const bool is_here = one->first.first == plane;
      if (is_here && !std::exchange(one->second, false)) {
        gone(one->first.second);
        one = found_.erase(one);
      } else {
        ++one;
      }
    }
  }

  std::uint64_t count() const noexcept { return count_; }  ///< Found so far.

 private:
  std::map<std::pair<Plane, std::uint64_t>, bool> found_;  // Whether it was seen in this scan.
  std::uint64_t count_ = 0;
};

}  // namespace striper::program
