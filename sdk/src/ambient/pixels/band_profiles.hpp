// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "ambient/pixels/line_path.hpp"

namespace striper::detail {

/// Groups of neighbouring scan lines, averaged: a few dozen profiles across the stripe stand for
/// the image, and are what is compared with another one. CV_32F each, a band a row. Colour images
/// give the profiles of each channel one after the other. Both fields are interpolated to the rows
/// half-way between them where the search runs down the columns.
struct BandProfiles {
  cv::Mat plain;
  cv::Mat smooth;  ///< Through a Gaussian of about a stripe's width.
  cv::Mat side;    ///< Means of a few samples: what a stripe must rise above on both sides.
  /// What an interpolation half-way between the samples may be wrong by, as `smooth` leaves it:
  /// zero on ramps and gentle curves, large at steps. Empty where nothing is interpolated.
  cv::Mat interpolation_variance;
};

/// One exposure over another.
struct ProfilePair {
  const BandProfiles& over;
  const BandProfiles& under;
  bool interpolated;  ///< The rows of one lie between those of the other.
  float noise;        ///< As LineSearch::noise_of says.
};

/// Makes band profiles, and looks in `over - under` for a bright stripe that runs across all bands.
/// No allocation after the first profiles of a size. Not thread-safe.
class LineSearch {
 public:
  static constexpr int kMostBands = 96;

  /// @param most_bands so many groups of scan lines stand for an image, at most kMostBands.
  explicit LineSearch(int most_bands = kMostBands) noexcept : most_bands_(most_bands) {}

  void profile(const Frame& exposure, StripeAxis axis, BandProfiles& profiles);

  /// Of all rows of an image, CV_8U or CV_16U. @param variance of each pixel, which `profiles` keep
  /// as interpolation_variance; CV_32FC1, may be empty.
  void profile(const cv::Mat& image, const cv::Mat& variance, StripeAxis axis,
               BandProfiles& profiles);

  /// One sigma of a height of `a` over `b`, or of `b` over `a`: the stripe and edges are few and do
  /// not move a median.
  float noise_of(const BandProfiles& a, const BandProfiles& b);

  /// How strongly the stripe shows in every pair at the same place: the mean height, in sigmas, of
  /// the best path from band to band. Noise alone gives a little over 1, a clear stripe up to
  /// `LinePath::kClear`, a dark stripe nothing.
  ///
  /// @param bands of each channel. @param most_jump how many samples the stripe may climb from one
  /// band to the next.
  double strength(std::span<const ProfilePair> pairs, int bands, int most_jump);

  /// The variance of white noise in `a - b`, from second differences along the samples.
  double white_variance_of_difference(const cv::Mat& a, const cv::Mat& b);

 private:
  void average(const cv::Mat& image, StripeAxis axis, cv::Mat& profiles) const;
  void shift_by_quarter(cv::Mat& profiles, int direction);
  void find_interpolation_variance(const cv::Mat& profiles, cv::Mat& variances);
  void fold_heights(const ProfilePair& pair, int band, int length, int fold,
                    std::span<float> heights);

  int most_bands_;
  LinePath path_;
  cv::Mat differences_;  // Scratch, as all that follows.
  std::vector<float> values_;
  std::vector<float> unfolded_;
  std::vector<float> heights_;
  std::vector<float> others_;
};

/// @param values CV_32F. No allocation.
void set_to_zero(cv::Mat& values);

/// The mean square of `a - b`, over the samples that both have.
double mean_square_difference(const cv::Mat& a, const cv::Mat& b);

}  // namespace striper::detail
