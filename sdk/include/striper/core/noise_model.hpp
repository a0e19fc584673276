// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>

namespace striper {

/// Variance of a value that was rounded to whole DN, DN^2.
inline constexpr double kRounding_dn2 = 1.0 / 12.0;

/// The photon-transfer line of a camera: the variance of a pixel as a function of its value.
///
/// var = read_noise_dn^2 + dn_per_electron * max(DN - black_level_dn, 0) + 1/12, in DN^2; the last
/// term is quantisation.
struct NoiseModel {
  double read_noise_dn = 0.0;    ///< Excludes quantisation.
  double dn_per_electron = 0.0;  ///< 0: no shot noise.
  double black_level_dn = 0.0;
  std::optional<int> bit_depth =
      std::nullopt;  ///< Of the images it was measured on, where that is known.

  /// The same camera's noise in images of another bit depth: a DN is another part of full scale.
  /// As it is where its own depth is not known.
  NoiseModel at_bit_depth(int depth) const noexcept {
    if (!bit_depth || *bit_depth == depth) return *this;
    const double scale = std::exp2(depth - *bit_depth);
    return {scale * read_noise_dn, scale * dn_per_electron, scale * black_level_dn, depth};
  }

  /// The same where the model does not say its own depth: as it is, or as of 8 bits where that is
  /// nearer to the variance that images of `depth` show at `value_dn`.
  NoiseModel at_likely_depth(int depth, double shown_dn2, double value_dn) const noexcept {
    if (bit_depth) return at_bit_depth(depth);
    NoiseModel of_8_bits = *this;
    of_8_bits.bit_depth = 8;
    const NoiseModel scaled = of_8_bits.at_bit_depth(depth);
    const double between2 = variance_dn2(value_dn) * scaled.variance_dn2(value_dn);
    const bool is_scaled =
        depth > 8 && std::isfinite(shown_dn2) && shown_dn2 * shown_dn2 > between2;
    return is_scaled ? scaled : *this;
  }

  double variance_dn2(double value_dn) const noexcept {
    const double light_dn = value_dn > black_level_dn ? value_dn - black_level_dn : 0.0;
    return read_noise_dn * read_noise_dn + dn_per_electron * light_dn + kRounding_dn2;
  }

  friend bool operator==(const NoiseModel&, const NoiseModel&) = default;
};

}  // namespace striper
