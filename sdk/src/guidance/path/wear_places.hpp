// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

namespace striper::detail {

/// Where on the road the states of wear are: what each beam saw last, and what the foremost beam
/// saw before, until the next one has passed there. Wear is a thing of the road: that beam sees
/// the same edge again, and what is known of it then is worth as much as the new look.
///
/// States are counted from 0: one a beam, then the copies. No allocation.
class WearPlaces {
 public:
  static constexpr std::size_t kMostBeams = 8;
  static constexpr std::size_t kMostCopies = 12;

  /// @param beam_x_m where the beams are, forward; 1 to 8.
  explicit WearPlaces(std::span<const double> beam_x_m) noexcept;

  int states() const noexcept { return beams_ + copies_; }
  void clear() noexcept;

  /// How wear at a place follows from the nearest states on either side of it: of an
  /// Ornstein-Uhlenbeck process between them. A state that there is not has weight 0.
  struct Bridge {
    int before = 0;
    int after = 0;
    double before_weight = 0.0;
    double after_weight = 0.0;
    double unknown = 1.0;  ///< Share of the wear's variance that neither tells.
  };
  Bridge bridge(int beam, double place_m, double length_m) const noexcept;

  /// A beam's state is now of a place. @return the copy that is to be made of it.
  std::optional<int> arrive(int beam, double place_m) noexcept;

 private:
  static constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

  double& place_of(int state) noexcept { return place_m_[static_cast<std::size_t>(state)]; }

  std::array<double, kMostBeams + kMostCopies> place_m_;
  std::array<bool, kMostBeams> sees_copies_{};
  int beams_;
  int copies_ = 0;
  int foremost_ = 0;
  int newest_ = 0;       // Of the copies.
  double step_m_ = 0.0;  // Between copies, at least.
};

}  // namespace striper::detail
