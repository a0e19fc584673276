// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include <Eigen/Core>

namespace striper {

/// A calibration board printed on a flat face: alternating squares with a white border around them.
/// The pattern is centred on the face; seen from its front, the square at the top left is black.
struct Checkerboard {
  int columns = 8;  ///< Inner corners from left to right.
  int rows = 6;     ///< Inner corners from top to bottom.
  double square_m = 0.04;
  double border_m = 0.04;  ///< White margin around the squares; beyond it the face's own colour.
  double black = 0.05;     ///< Reflectance of the black squares.
  double white = 0.85;     ///< Reflectance of the white squares and the border.

  /// Position on the face of inner corner (column, row), (right, up) from the face's centre, m.
  Eigen::Vector2d corner_m(int column, int row) const noexcept {
    return {(column - 0.5 * (columns - 1)) * square_m, (0.5 * (rows - 1) - row) * square_m};
  }
};

/// A painted road stripe on a flat face, along the face's `up` direction.
struct PaintedStripe {
  double width_m = 0.10;
  double offset_m = 0.0;  ///< Of the stripe's middle, to the right of the face's centre.
  double dash_m = 0.0;    ///< Length of a dash; 0 is a continuous line.
  double gap_m = 0.0;     ///< Between dashes; a dash begins at the face's centre and goes up.
  double reflectance = 0.7;
  double wear = 0.0;                ///< Fraction of the paint that is worn off, 0 to 1, in patches.
  double grain_m = 0.02;            ///< Size of a worn patch.
  double retro_gain = 0.0;          ///< As in Material, of the paint alone.
  double retro_spread_rad = 0.035;  ///< As in Material.
};

/// Sawn wood: dark and light fibres along one direction of a flat face, without sharp edges.
struct WoodGrain {
  double fibre_m = 0.008;      ///< Width of a fibre.
  double length_m = 0.3;       ///< How far it goes on.
  double direction_rad = 0.0;  ///< Of the fibres, from the face's `right` towards its `up`.
  double dark = 0.15;          ///< Reflectance of the darkest fibres,
  double light = 0.6;          ///< and of the lightest.
};

/// A printed poster: rectangles of random size and grey, with sharp edges that are level and
/// upright on the face, large ones with smaller ones printed over them.
struct Poster {
  double cell_m = 0.16;    ///< Of the largest rectangles; the smallest are a quarter of it.
  double darkest = 0.05;   ///< Reflectances are drawn evenly between this
  double lightest = 0.85;  ///< and this, which the paper has.
  int seed = 1;            ///< Which poster.
};

/// What a surface does to light.
///
/// A diffuse surface has the radiance reflectance / pi * irradiance (Lambert). Glass beads in paint
/// add light that goes back to where it came from: the radiance is multiplied by
/// 1 + retro_gain * exp(-angle^2 / (2 retro_spread_rad^2)), `angle` being the one at the surface
/// between light and camera.
struct Material {
  double reflectance = 0.5;
  double retro_gain = 0.0;
  double retro_spread_rad = 0.035;
  /// Light that the surface sends out by itself, spectral radiance in the filter's band: a light
  /// source (rear light about 1 to 10), or a mirror image of the sun (2e4 and above).
  double radiance_w_m2_sr_nm = 0.0;
  /// Mottling of flat faces, as of grass or asphalt: the reflectance (of texture and all) varies
  /// smoothly by up to this fraction, over about `mottle_grain_m`.
  double mottle_contrast = 0.0;
  double mottle_grain_m = 0.05;
  std::variant<std::monostate, Checkerboard, PaintedStripe, WoodGrain, Poster> texture{};
};

}  // namespace striper
