// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>

#include "ambient/pixels/held_exposure.hpp"

namespace striper::detail {

/// Keeps exposures in time order until no lit one needs them any more.
///
/// A dark exposure serves a lit one only if it is where the pattern has the nearest dark one: after
/// a loss one side is missing, and never is something further away taken for it.
class ExposureQueue {
 public:
  /// Adds an exposure; its pixels are copied only where neither cv::Mat nor a lease keeps them.
  void add(const Frame& frame, std::uint64_t number);

  /// What comes from now on is unknown until the next `set_pattern`.
  void hold_unlabelled() noexcept { is_labelled_ = false; }

  /// So is what is held, from this exposure on; what is older is let go.
  void hold_from(std::uint64_t number) noexcept;

  /// Lets go of those whose source does not say what they are, and returns how many were not handed
  /// out yet and may have been lit.
  std::uint64_t drop_unlabelled() noexcept;

  /// The one that was added last is lit, whatever the pattern will be.
  void take_newest_as_lit() noexcept { held_.back()->light = Illumination::laser(0); }

  /// Gives up the lit exposures that have not been handed out, and returns how many.
  std::uint64_t give_up() noexcept;

  /// Labels what is held and what will come. @param pattern automatic where the exposures' own
  /// illumination follows no pattern.
  void set_pattern(const IlluminationPattern& pattern);
  const IlluminationPattern& pattern() const noexcept { return pattern_; }

  /// The oldest lit exposure that has not been handed out; null if there is none, or if it is not
  /// known whether an older one is lit.
  HeldExposure* next_lit() noexcept;

  /// @param is_last no more exposures will come.
  Neighbours neighbours_of(const HeldExposure& lit, DarkChoice choice, bool is_last) noexcept;

  /// Lets go of what no lit exposure can need.
  void forget(DarkChoice choice) noexcept;
  void clear() noexcept;

  std::size_t size() const noexcept { return held_.size(); }
  std::uint64_t dark_exposures() const noexcept { return dark_exposures_; }
  const HeldExposures& held() const noexcept { return held_; }

 private:
  struct Distances {
    std::uint64_t before = 0;  // 0: there is none.
    std::uint64_t after = 0;
    friend bool operator==(const Distances&, const Distances&) = default;
  };
  void label(HeldExposure& exposure) noexcept;
  Distances expected(std::uint64_t number, bool even_only) const noexcept;
  HeldExposure* find_dark(std::uint64_t number) noexcept;
  HeldExposure* dark_beside(const HeldExposure& lit, std::uint64_t distance, std::int64_t direction,
                            DarkChoice choice) noexcept;
  void release_newest() noexcept;

  IlluminationPattern pattern_;
  std::uint64_t reach_ = 0;  // How far before a lit exposure a dark one may serve it.
  std::uint64_t reach_of_fields_ = 0;
  bool is_labelled_ = false;
  std::uint64_t dark_exposures_ = 0;
  HeldExposures held_;
  std::vector<std::unique_ptr<HeldExposure>> free_;
};

}  // namespace striper::detail
