// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <striper/guidance/guidance_config.hpp>

namespace striper::program {

/// Why a value was not taken, for the operator; nothing where it was.
using Refusal = std::optional<std::string>;

/// The parameters of the report's Appendix B: shown in its units, checked where they are set.
///
/// Whatever is out of range is refused and changes nothing.
class ConsoleParameters {
 public:
  explicit ConsoleParameters(GuidanceConfig config) : config_(std::move(config)) {}

  const GuidanceConfig& config() const noexcept { return config_; }

  Refusal follow(FollowLine line);
  Refusal set_odometer(double counts_per_ft);
  /// By what was driven: counts over a distance. @param distance_ft 1 to 52800
  Refusal calibrate_odometer(std::int64_t counts, double distance_ft);
  /// Of a swept fan its angle in degrees; of a beam that steps evenly its width in feet. All beams
  /// change by the same share.
  Refusal set_window(double size);
  Refusal set_points(double points);
  Refusal set_stripe_width(double points);
  Refusal set_threshold(std::size_t beam, double threshold);  ///< NaN: automatic.

  bool has_fan() const noexcept { return first().fan_rad > 0.0; }
  double window() const noexcept;  ///< In the unit of `set_window`.
  double window_ft() const noexcept;
  double stripe_points() const noexcept;
  double counts_per_ft() const noexcept;
  double full_scale(std::size_t beam) const noexcept;  ///< Of the converter, counts.
  std::string threshold_text(std::size_t beam) const;

  /// The lines of the report's box, without the laser's.
  std::vector<std::string> lines() const;

 private:
  const GuidanceBeam& first() const noexcept { return config_.beams.front(); }
  Refusal take(GuidanceConfig changed);

  GuidanceConfig config_;
};

}  // namespace striper::program
