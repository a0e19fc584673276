// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <striper/model/striper_model.hpp>
#include <striper/profile/segment_options.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper {

/// What is measured. Signs are positive away from the sensor; angles counter-clockwise.
enum class ToolKind {
  kLine,      ///< Distance from the origin, direction of the normal, straightness.
  kStep,      ///< How far the second surface's middle lies beyond the first's line.
  kGap,       ///< From the end of one surface to the next one's, along the first's line.
  kFlush,     ///< How far the second surface's near end lies beyond the first's line.
  kWidth,     ///< From end to end of one surface, along it.
  kAngle,     ///< From the first surface's normal to the second's, -pi to pi.
  kCircle,    ///< Radius and centre.
  kPosition,  ///< Where the lines of two surfaces meet.
  kArea,      ///< Between the second region's returns and the first's line; of one region, between
              ///< its returns and their chord.
};

/// A part of the scan plane, scan frame, metres. Everything by default.
struct MeasureRegion {
  double x_from_m = -std::numeric_limits<double>::infinity();
  double x_to_m = std::numeric_limits<double>::infinity();
  double y_from_m = -std::numeric_limits<double>::infinity();
  double y_to_m = std::numeric_limits<double>::infinity();

  bool contains(const Eigen::Vector2d& p_scan) const noexcept {
    return p_scan.x() >= x_from_m && p_scan.x() <= x_to_m && p_scan.y() >= y_from_m &&
           p_scan.y() <= y_to_m;
  }
};

/// One thing to measure, by name. Of two surfaces and one region (or none, which is everything):
/// its two largest pieces, in the order of the scan.
struct MeasureTool {
  std::string name;
  ToolKind kind = ToolKind::kLine;
  std::vector<MeasureRegion> regions;
};

/// Reads `NAME:TOOL[:REGION[;REGION]]`, TOOL one of `line step gap flush width angle circle
/// position area`, REGION `x=A..B,y=C..D` (either may be left out, and so may each end).
/// @throws Error{kUsage} naming the text and what was expected.
MeasureTool parse_measure_tool(std::string_view text);

enum class MeasureStatus {
  kOk,
  kNoLine,     ///< What is in the region is no straight line (or circle).
  kFewPoints,  ///< Fewer returns than it takes.
  kAmbiguous,  ///< Several surfaces of the region may be meant, or what they say is not determined.
  kOutside,    ///< The end that is measured lies beyond the region, or beyond the scan.
};

/// `ok`, `no_line`, `few_points`, `ambiguous`, `outside`. Static storage.
std::string_view to_string(MeasureStatus status) noexcept;

/// One row of what a tool says of one scan.
struct Measurement {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  std::string tool;          ///< NAME and the tool's row: `a.step`, `b.line.distance`.
  double value = kNone;      ///< NaN unless `status` is kOk.
  double sigma = kNone;      ///< One sigma of the random error.
  double sigma_cal = kNone;  ///< One sigma of the calibration's, alike in all scans; NaN where the
                             ///< model has no covariance.
  std::string_view unit{"m"};  ///< `m`, `rad` or `m2`.
  int points = 0;              ///< Returns that it is made from.
  MeasureStatus status = MeasureStatus::kFewPoints;
};

/// Measures scans with tools.
///
/// Each scan is cut into straight pieces (Segmenter), speckle is left out, and each tool takes the
/// piece that most of its region's returns are on. Lines are fitted in 1/range (LineSums), where
/// the noise is Gaussian; what the returns scatter beyond their sigmas widens the bars. An end of a
/// surface is known to spacing / sqrt(12). sigma_cal moves all returns together along the modes of
/// the model's covariance and measures again, so what cancels (a step, a width) cancels there too.
///
/// Straightness is peak to valley of a polynomial of fourth order about the line: bows and waves as
/// long as the piece. Noise alone makes it two to three of its sigmas.
///
/// About .15 ms for 640 returns and a few tools, 1.5 ms with a covariance. Not thread-safe.
class Measurer {
 public:
  /// @param model of the scans, whose covariance makes sigma_cal and whose geometry says along
  ///        which line the noise moves returns; may be null.
  /// @throws Error{kUsage} where a tool has the wrong number of regions, or a name is there twice.
  explicit Measurer(std::vector<MeasureTool> tools,
                    std::shared_ptr<const StriperModel> model = nullptr,
                    const SegmentOptions& options = {});
  Measurer(Measurer&&) noexcept;
  Measurer& operator=(Measurer&&) noexcept;
  ~Measurer();

  /// Returns one row for each of `rows()`, in that order; valid until the next call.
  const std::vector<Measurement>& measure(const PolarScan& scan);

  /// The names of the rows of every scan.
  const std::vector<std::string>& rows() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
