// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include <striper/core/frame.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper {

/// Whether a scan line (column or row) of the image shows the stripe, and if not, why.
enum class TruthStatus : std::uint8_t {
  kVisible,       ///< The stripe is there; it may still be too weak to see, see the amplitude.
  kNoSurface,     ///< No visible surface meets the laser plane in this scan line.
  kShadowed,      ///< A surface does, and something stands between it and the laser.
  kOutsideFan,    ///< A surface does, beyond the ends of the laser's fan.
  kOutsideModel,  ///< The scan line's pixels have no ray.
};

/// `visible`, `no_surface`, `shadowed`, ... Static storage.
std::string_view to_string(TruthStatus status) noexcept;

/// Where the middle of the laser plane is on a surface, seen by the camera.
struct TrueReturn {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  double u_px = kNone;  ///< Full-sensor pixel, exact through the lens to 1e-9 px.
  double v_px = kNone;
  double x_m = kNone;  ///< In the laser's standing scan frame (CONVENTIONS.md).
  double y_m = kNone;
  double range_m = kNone;
  double bearing_rad = kNone;
  /// Height in DN of the Gaussian whose integral over each pixel is the stripe's noise-free
  /// profile: background not included, nothing clipped. NaN when not lit.
  double amplitude_dn = kNone;
  /// Standard deviation of that Gaussian along the scan line, sensor pixels: laser and lens blur
  /// together, without the pixel's own width. NaN when not lit.
  double width_px = kNone;
  int object = -1;         ///< Index into Scene::objects.
  bool near_edge = false;  ///< Within Scene::edge_distance_px of where the surface or its light
                           ///< ends, or bends: the profile is not one whole Gaussian.
  bool blind = false;      ///< Daylight or a light source alone saturates pixels here.
  bool clipped = false;    ///< The stripe's own peak saturates.
};

/// The truth of one scan line of the image.
struct TrueLine {
  TruthStatus status = TruthStatus::kNoSurface;
  /// The brightest return; where there is none, all that is known: the scan line's own coordinate
  /// (and where the unlit surface is, if kShadowed or kOutsideFan).
  TrueReturn brightest;
  std::vector<TrueReturn> others;  ///< Further lit returns in this scan line, brightest first.
};

/// What is known of one exposure: per scan line of the image, in order, where the stripe is.
struct Truth {
  std::uint64_t sequence = 0;
  double time_s = 0.0;
  int laser = 0;
  Field field = Field::kProgressive;
  StripeAxis axis = StripeAxis::kColumns;
  std::vector<TrueLine> lines;  ///< One per column (or row) of the image.
};

}  // namespace striper
