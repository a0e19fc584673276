// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <striper/core/csv_table.hpp>
#include <striper/guidance/beam_sweep.hpp>
#include <striper/guidance/guidance_config.hpp>
#include <striper/motion/odometer_csv.hpp>

namespace striper {

/// A line of `tape.csv`: where the line lay beside the truck, by a tape measure.
struct TapeReading {
  double time_s = 0.0;     ///< When; best while the truck stood.
  double x_m = 0.0;        ///< Where along the truck, forward of the gun's reference,
  double lateral_m = 0.0;  ///< and how far to the left of its axis there.
  double sigma_m = 0.001;  ///< Of the reading.
};
std::span<const CsvColumn<TapeReading>> tape_columns();

struct BeamAlignmentOptions {
  double zero_sigma_m = 0.00127;  ///< A beam whose zero is not known to 0.05 in is refused,
  double scale_sigma = 0.01;      ///< as is one whose scale is not to a hundredth.
  double tape_misfit = 3.0;  ///< Tape readings further off than so many sigma (rms) are refused,
  double line_misfit_m = 0.005;  ///< and a line that bends more than this beside the beams.
  /// Sights are taken so far apart: half as far, and the pulls of scales are the same.
  double every_m = 0.5;
};

/// Why an alignment is not to be trusted.
enum class AlignmentFlaw {
  kNoTape,   ///< No reading at a time when beams saw the line.
  kNotSeen,  ///< A beam did not see the line.
  kZero,     ///< Sigma of a beam's zero; limit.
  kScale,    ///< Sigma of its scale; limit: the truck must wander.
  kTape,     ///< Tape readings and beams disagree: rms in sigma; limit.
  kLine,     ///< Beams disagree along the drive: the line is not straight. Metres; limit.
};
/// `no_tape`, `not_seen`, `zero`, `scale`, `tape`, `line`. Static storage.
std::string_view to_string(AlignmentFlaw flaw) noexcept;

struct AlignmentFinding {
  AlignmentFlaw code = AlignmentFlaw::kNoTape;
  std::string beam;  ///< Empty: of all.
  double value = 0.0;
  double limit = 0.0;
};

/// What a drive along a taped line says of the beams.
struct BeamAlignment {
  std::vector<double> zero_m;  ///< Of each beam, in the config's order; lateral = zero + scale * y.
  std::vector<double> scale;
  Eigen::MatrixXd covariance;              ///< Of zero 0, scale 0, zero 1, scale 1, ...
  std::size_t places = 0;                  ///< Along the drive, at which beams were compared.
  std::size_t tape_readings = 0;           ///< That were used.
  double tape_rms = 0.0;                   ///< Of the tape readings' residuals, in sigma.
  double line_rms_m = 0.0;                 ///< Of the beams' residuals along the drive.
  std::vector<AlignmentFinding> findings;  ///< None: to be trusted.

  bool is_trusted() const noexcept { return findings.empty(); }
};

/// Finds the zero and the scale of every beam from a drive beside a straight taped line, and from a
/// few readings of a tape measure.
///
/// All beams see one straight line: at each place along the drive it has two unknowns, where it is
/// and its direction; three beams see it three times. So the drive alone tells all zeros and scales
/// but three of their combinations (aside, turned, and larger), whatever the truck does as long as
/// it wanders; the tape tells those. Least squares over all places, whose own unknowns are
/// eliminated; what a beam sees is the measurement, so that its noise does not shrink the scale.
/// The covariance is the solution's, with the beams' noise as large as the residuals show it to be.
///
/// A line that bends evenly all along looks like other zeros, and is not found out; one that bends
/// somewhere is (`kLine`). Lay it along a string.
///
/// What the config says of zeros and scales is not looked at: the result replaces it. Not
/// thread-safe. `solve` takes as long as the drive is.
/// Source: Figures 13 and 14 of Advanced Retro Technology, *Automated Paint Restriping Recognition
/// and Guidance System*, UCD-ARR-91-11-01-01, 1991, where a cart is moved over three tapes; that
/// one moves all beams alike, and tells no turn.
class AlignmentDrive {
 public:
  explicit AlignmentDrive(const GuidanceConfig& config);  ///< @throws Error as `validate` does.
  AlignmentDrive(AlignmentDrive&&) noexcept;
  AlignmentDrive& operator=(AlignmentDrive&&) noexcept;
  ~AlignmentDrive();

  /// As `Guidance` takes them, in the order of time.
  void take(const OdometerReading& reading);
  void take(const BeamSweep& sweep);

  /// @param tape in any order. @throws Error{kBadValue} where a reading is no number.
  BeamAlignment solve(std::span<const TapeReading> tape,
                      const BeamAlignmentOptions& options = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Writes what was found into the truck: zeros, scales and their covariance.
void apply(const BeamAlignment& alignment, GuidanceConfig& config);

}  // namespace striper
