// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <striper/core/csv_table.hpp>
#include <striper/guidance/guidance_config.hpp>

namespace striper {

/// A line of `volts.csv`: where the gun stood for a voltage of the output, by a tape measure.
struct VoltsReading {
  double volts = 0.0;
  double lateral_m = 0.0;  ///< To the left of the truck's axis.
  double sigma_m = 0.001;
};
std::span<const CsvColumn<VoltsReading>> volts_columns();

/// The output's zero and scale, as `GuidanceOutput` has them.
struct OutputAlignment {
  double offset_m = 0.0;
  double volts_per_m = 0.0;
  double sigma_offset_m = 0.0;
  double sigma_volts_per_m = 0.0;
  double misfit = 0.0;  ///< Residuals over their sigma, rms.
  std::size_t readings = 0;
  bool is_trusted = false;  ///< Offset known to 0.05 in, scale to a hundredth, misfit below 3.
};

/// Fits lateral = offset + volts / volts_per_m. The covariance grows with the misfit.
/// Source: Figure 14 of Advanced Retro Technology, *Automated Paint Restriping Recognition and
/// Guidance System*, UCD-ARR-91-11-01-01, 1991: -.249 V/in. Thread-safe.
OutputAlignment align_output(std::span<const VoltsReading> readings);

/// A line of `painted.csv`: one end of what a gun painted, by a tape measure.
struct PaintedEnd {
  std::string gun;
  bool is_on = true;       ///< Paint begins here (its signal went on); else it ends.
  double signal_m = 0.0;   ///< Where the signal changed: `from_m` or `to_m` of guns.csv.
  double speed_m_s = 0.0;  ///< At that moment.
  double painted_m = 0.0;  ///< Where the end is on the road, from the same zero.
  double sigma_m = 0.005;
};
std::span<const CsvColumn<PaintedEnd>> painted_columns();

/// What painted ends say of one gun.
struct GunAlignment {
  std::string gun;
  double x_m = 0.0;
  double on_delay_s = 0.0;
  double off_delay_s = 0.0;
  double sigma_x_m = 0.0;
  double sigma_on_s = 0.0;
  double sigma_off_s = 0.0;
  double misfit = 0.0;  ///< Residuals over their sigma, rms.
  std::size_t ends = 0;
  bool is_trusted = false;  ///< Delays known to 2 ms, place to 0.01 m: needs two speeds.
};

/// Fits painted = signal + x + speed * delay, of each gun one place and two delays. What one speed
/// alone cannot tell, place from delay, has a large sigma. Sigmas grow with the misfit.
/// Thread-safe. @return a row for each gun that is named, in the order of first naming.
std::vector<GunAlignment> align_guns(std::span<const PaintedEnd> ends);

/// Writes what was found into the truck; the sigma of the output's zero is of the lateral position,
/// too. @throws Error{kBadValue} naming a gun that the config does not have.
void apply(const OutputAlignment& alignment, GuidanceConfig& config);
void apply(const GunAlignment& alignment, GuidanceConfig& config);

}  // namespace striper
