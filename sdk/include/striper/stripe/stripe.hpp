// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <striper/core/frame_time.hpp>
#include <striper/core/pixel_grid.hpp>
#include <striper/core/return_status.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper {

/// The stripe of one frame: parallel arrays, one element per return. All lengths are in full-sensor
/// pixels.
///
/// With one return per scan line (every rule but `all`) element i belongs to scan line i of the
/// image: column i with StripeAxis::kColumns, row i with kRows. Along the scan line the coordinate
/// is exact; `across_px` is what was measured. An element whose status is kMissing by `verdict` has
/// NaN in every number.
struct Stripe {
  StripeAxis axis = StripeAxis::kColumns;
  PixelGrid grid;       ///< Of the image it came from.
  int line_count = 0;   ///< Columns (kColumns) or rows (kRows) of that image.
  bool is_seen = true;  ///< False: nothing in the image is a laser's stripe, and no element is kOk.

  std::vector<std::int32_t> line;   ///< Column (kColumns) or row (kRows) of the image.
  std::vector<double> across_px;    ///< Position across the stripe: v for kColumns, u for kRows.
  std::vector<float> sigma_px;      ///< One-sigma random error of `across_px`.
  std::vector<float> amplitude_dn;  ///< Peak above the background.
  std::vector<float> width_px;      ///< The profile's Gaussian sigma.
  std::vector<float> confidence;    ///< 0 to 1: that the stripe is within .5 px or 3 sigmas of it.
  std::vector<ReturnStatus> status;

  std::size_t size() const noexcept { return line.size(); }

  /// Sensor coordinate along the stripe of element i: u for kColumns, v for kRows.
  double along_px(std::size_t i) const noexcept {
    return axis == StripeAxis::kColumns ? grid.sensor_u(line[i]) : grid.sensor_v(line[i]);
  }
  double u_px(std::size_t i) const noexcept {
    return axis == StripeAxis::kColumns ? along_px(i) : across_px[i];
  }
  double v_px(std::size_t i) const noexcept {
    return axis == StripeAxis::kColumns ? across_px[i] : along_px(i);
  }

  /// Half a pixel of the image across the stripe, in sensor pixels: the paper's pixel-quantised
  /// error.
  double half_pixel_px() const noexcept {
    return 0.5 * (axis == StripeAxis::kColumns ? grid.v.step : grid.u.step);
  }

  /// Takes the values of an element away. @param reason why it is missing.
  void drop(std::size_t i, ReturnStatus reason);

  /// Removes every element; the memory stays.
  void clear();

  /// Makes room for so many elements.
  void reserve(std::size_t count);

  /// Adds an element without values for a scan line and returns its index.
  std::size_t append(int line_number);

  /// Makes one element per scan line; no allocation once it was as large. Every number becomes NaN,
  /// `line` counts up from 0 and every status becomes kNoStripe.
  void reset(int lines);

  /// The same for who writes every number and status: those are left as they happen to be.
  void resize(int lines);
};

}  // namespace striper
