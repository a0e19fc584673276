// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <striper/guidance/guidance_config.hpp>
#include <striper/guidance/guidance_csv.hpp>

namespace striper::detail {

/// Where the vehicle is at a moment of a gun's clock.
struct GunMoment {
  double time_s = 0.0;
  double distance_m = 0.0;
  double speed_m_s = 0.0;
  std::int64_t counts = 0;
};

/// A gun, the list of its signals (the report's Appendix C), and where it has painted.
class GunPost {
 public:
  GunPost(const GuidanceConfig& config, const GuidanceGun& gun);

  PaintGun& gun() noexcept { return *gun_; }
  int line() const noexcept { return line_; }

  /// Decides the signal. @param is_allowed false: a fault forbids paint, all waiting is forgotten.
  /// @return the stretch that ends where the signal changes.
  std::optional<GunLine> update(const GunMoment& moment, bool is_allowed);
  /// The stretch that is under way, up to here.
  GunLine stretch_to(const GunMoment& moment) const;

  bool is_on() const noexcept { return stretch_.is_on; }
  /// Whether it has painted there, a while ago at most. @param here_m where the truck is.
  bool has_painted(double at_m, double here_m) const noexcept;

  double on_m() const noexcept { return on_m_; }
  std::uint64_t dashes() const noexcept { return dashes_; }

 private:
  std::unique_ptr<PaintGun> gun_;  // Others point to it.
  int line_;
  double x_m_;
  bool has_begun_ = false;
  GunLine stretch_;
  double before_m_ = 0.0;  // Length of the stretch before.
  double on_m_ = 0.0;
  std::uint64_t dashes_ = 0;
  std::vector<std::pair<double, double>> painted_;  // A ring.
  std::size_t next_ = 0;
};

}  // namespace striper::detail
