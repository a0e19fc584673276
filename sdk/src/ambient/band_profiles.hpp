// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/frame.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper::detail {

/// Averages groups of neighbouring lines: a few dozen profiles across the stripe stand for the
/// picture. Colour pictures give the profiles of each channel one after the other. Both fields
/// are interpolated to the lines half-way between them where the search runs down the columns.
/// @return CV_32F, one band a row.
cv::Mat band_profiles(const Frame& exposure, StripeAxis axis);

/// What of an exposure is compared with another one. CV_32F each, a band a row.
struct BandProfiles {
  cv::Mat plain;
  cv::Mat smooth;  ///< Through a Gaussian of about a line's width.
  cv::Mat side;    ///< Means of a few samples: what a line must rise above on both sides.
  /// What an interpolation half-way between the samples may be wrong by, as `smooth` leaves it:
  /// zero on ramps and gentle curves, large at steps. Empty where nothing is interpolated.
  cv::Mat interpolation_variance;
};

/// @param is_field the profiles were interpolated.
BandProfiles filter_profiles(const cv::Mat& plain, bool is_field);

/// One exposure over another.
struct ProfilePair {
  const BandProfiles& over;
  const BandProfiles& under;
  bool interpolated;  ///< The rows of one lie between those of the other.
};

/// How strongly a bright line that runs across all bands shows in `over - under`, and in every pair
/// at the same place: the mean height, in sigmas, of the best path from band to band. Noise alone
/// gives a little over 1, a clear line up to `LinePath::kClear`, a dark line nothing.
///
/// @param most_jump how many samples the line may climb from one band to the next.
double line_strength(std::span<const ProfilePair> pairs, int bands, int most_jump);

/// The mean square of `a - b`, over the samples that both have.
double mean_square_difference(const cv::Mat& a, const cv::Mat& b);

/// The variance of white noise in `a - b`, from second differences along the samples.
double white_variance_of_difference(const cv::Mat& a, const cv::Mat& b);

}  // namespace striper::detail
