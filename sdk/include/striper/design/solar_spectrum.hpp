// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper {

// The sun at air mass 1.5: data/solar/am15g.csv, which is built in and says where it comes from.
// Thread-safe; microseconds.

/// Spectral irradiance on a surface that faces the sun, W/m^2 a nanometre; straight between the
/// table's nodes, 0 outside.
double solar_irradiance_w_m2_nm(double wavelength_nm);

/// Irradiance between two wavelengths, W/m^2: the exact integral of the same.
double solar_irradiance_w_m2(double from_nm, double to_nm);

/// By what factor a filter lowers what a silicon sensor sees of the sun: photons from 300 to
/// 1100 nm over those within the filter's band. Every photon that silicon can see counts the same
/// (a real sensor has its own efficiency), the filter's own transmission not.
/// @param centre_nm, width_nm of the band, which has to be within 300 to 1100 nm.
double solar_suppression(double centre_nm, double width_nm);

}  // namespace striper
