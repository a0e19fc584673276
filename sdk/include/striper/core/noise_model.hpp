// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper {

/// The photon-transfer line of a camera: the variance of a pixel as a function of its value.
///
/// var = read_noise_dn^2 + dn_per_electron * max(DN - black_level_dn, 0) + 1/12, in DN^2; the last
/// term is quantisation.
struct NoiseModel {
  double read_noise_dn = 0.0;    ///< Excludes quantisation.
  double dn_per_electron = 0.0;  ///< 0: no shot noise.
  double black_level_dn = 0.0;

  double variance_dn2(double value_dn) const noexcept {
    const double light_dn = value_dn > black_level_dn ? value_dn - black_level_dn : 0.0;
    return read_noise_dn * read_noise_dn + dn_per_electron * light_dn + 1.0 / 12.0;
  }

  friend bool operator==(const NoiseModel&, const NoiseModel&) = default;
};

}  // namespace striper
