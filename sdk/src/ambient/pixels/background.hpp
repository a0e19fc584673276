// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/lit_frame.hpp>
#include <striper/core/noise_model.hpp>

#include "ambient/pixels/masked_pixels.hpp"
#include "ambient/pixels/motion.hpp"

namespace striper::detail {

/// The dark exposures that a lit one is compared with. At least one is there.
struct DarkPair {
  const cv::Mat* before = nullptr;  ///< Null where it is missing.
  const cv::Mat* after = nullptr;
  double weight_after = 0.5;  ///< Of `after` in the interpolation in time.
  /// The dark rows lie half-way between the lit rows: fields of the other parity.
  bool is_between_rows = false;
  int row_above = 0;  ///< Dark row just above lit row 0: -1 or 0. Only if `is_between_rows`.

  bool has_both() const noexcept { return before != nullptr && after != nullptr; }
  const cv::Mat& any() const noexcept { return before != nullptr ? *before : *after; }
};

/// Fills in what a lit exposure is to be freed of: `dark`, `dark_noise_gain`, `variance`, `blind`.
///
/// - `dark` is the one dark exposure where there is only one, without a copy; else the mean of both
///   weighted by time, which cancels what changes linearly. Between field rows it is interpolated
///   with the 4 taps (-1, 9, 9, -1) / 16.
/// - `variance`: where before and after differ by more than noise, what the texture that passes by
/// may leave; without the two, what the last ones said, and to
///   either side of it; and, between field rows, what the interpolation may leave at edges. Empty
///   where both are nothing.
/// - `blind`: saturated in a dark exposure, or in the lit one where no stripe can be so (a long
/// run,
///   or near a light source), and a few pixels around. Empty where nothing is.
///
/// One read of each image, one write of `dark` where it is not an exposure itself. No allocation
/// after the first frames of a size. Not thread-safe.
class Background {
 public:
  /// @param noise of the camera; empty: measured, without shot noise.
  explicit Background(const std::optional<NoiseModel>& noise);

  /// `frame.lit` and `frame.full_scale_dn` are set; the rest points into this object and into the
  /// images of `pair` until the next call.
  void subtract(const DarkPair& pair, LitFrame& frame);

  /// The same with what stands still before a sensor that does. @param standing as long as `frame`
  /// is used. @param noise_gain its noise variance, in parts of an exposure's.
  /// @return the part of the image that is darker than what stands: of a standing scene none,
  /// or a few per cent where a stripe was long.
  double subtract_standing(const cv::Mat& standing, float noise_gain, LitFrame& frame);

 private:
  // The least squared third difference that is an edge.
  struct EdgeLimit {
    float floor;
    float per_level;
    float black;
  };

  void prepare(cv::Size size);
  template <typename Pixel>
  void subtract_pixels(const DarkPair& pair, LitFrame& frame);
  template <typename Pixel>
  void read_standing(const DarkPair& pair, const LitFrame& frame);
  template <typename Pixel>
  void read_strips(const DarkPair& pair, const LitFrame& frame);
  template <typename Pixel>
  void measure_noise(const DarkPair& pair, int full_scale_dn);
  template <typename Pixel>
  double noise_of_neighbours(const cv::Mat& image, int full_scale_dn);
  template <typename Pixel>
  void interpolate_between_rows(const DarkPair& pair, double averaging, cv::Size size);
  void write_edges(const EdgeLimit& limit, const std::int32_t* level, float* variance, int cols);
  bool add_motion(const DarkPair& pair, double averaging, const LitFrame& frame);
  template <typename Pixel>
  double darker_part(const cv::Mat& lit, const cv::Mat& standing, double noise_gain) const;

  template <typename Pixel>
  void take_noise(const DarkPair& pair, int full_scale_dn);

  NoiseModel noise_;  // Of an exposure, in the DN of these images.
  std::optional<NoiseModel> given_noise_;
  int noise_full_scale_dn_ = 0;  // Of the images that what was given is scaled to.
  Motion motion_;
  MaskedPixels masked_;

  cv::Mat dark_;
  cv::Mat variance_;
  bool has_edges_ = false;            // variance_ holds more than motion.
  std::vector<float> sorted_;         // Scratch.
  std::vector<std::int32_t> rows_;    // Four dark rows, interpolated in time, 1/16 DN.
  std::vector<std::int32_t> thirds_;  // Their third differences, and sums of two and four.
};

}  // namespace striper::detail
