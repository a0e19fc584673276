// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/noise_model.hpp>

namespace striper {

/// The photon-transfer line of a camera, and how well it is known. DN of the images.
struct PhotonTransferFit {
  NoiseModel noise;
  /// Standard errors; what the points lie further off the line than chance has them do is in them.
  double read_noise_sigma_dn = 0.0;
  double dn_per_electron_sigma = 0.0;
  double lowest_dn = 0.0;  ///< Levels of light that were seen.
  double highest_dn = 0.0;
  double misfit = 0.0;  ///< How far the variances lie off the line, rms, relative.
  int pictures = 0;
};

/// Measures a camera's noise from images of a scene at rest without the laser: half the variance
/// of the difference of two successive images is the variance of a pixel, without the scene and
/// without the sensor's fixed pattern; against the light it is the photon-transfer line, var =
/// read^2 + dn_per_electron * (DN - black) + 1/12 (Janesick 2007, Photon Transfer, chapter 5).
///
/// The light of a pixel is told by the image before the two that are compared. By their own mean
/// it would be drawn towards the brightness that most pixels have, and the line be too flat
/// (regression dilution: 3 % in the simulated room); an instrument that is independent of their
/// noise leaves it straight (Fuller 1987, Measurement Error Models, chapter 1.4).
///
/// Pixels that change by more than 4 standard deviations (something moved) are left out, as are
/// those near either end of the scale; a change of light between two images cancels. Not
/// thread-safe. 10 ns a pixel.
class PhotonTransfer {
 public:
  static constexpr int kLeastImages = 4;

  /// Takes an image: CV_8UC1 or CV_16UC1. @param stream keeps apart what must not be compared: the
  /// two fields of a frame. @throws Error{kBadValue} where it is of another size or depth.
  void add(const cv::Mat& image, int full_scale_dn, int stream = 0);

  int images() const noexcept { return images_; }

  /// Fits the line. The black level cannot be told from the images themselves: it is what they
  /// hold where no light falls, the mean with the lens covered.
  /// @throws Error{kUntrustworthy} saying why: too few images, all the same, too little contrast,
  ///         not a line (compressed or corrected images), below zero at the black level.
  PhotonTransferFit fit(double black_level_dn) const;

 private:
  static constexpr int kLevels = 256;

  // The pixels of one level of light, over all pairs.
  struct Level {
    double count = 0.0;
    double value_sum = 0.0;
    double variance_sum = 0.0;  // Of single pixels, times their number.
  };

  // The last two images; empty before they came.
  struct Stream {
    cv::Mat before;
    cv::Mat last;
  };

  void require_same_kind(const Stream& stream, const cv::Mat& image, int full_scale_dn) const;

  // The differences of a level that count, bins of `histogram_`; none by default.
  struct Gate {
    int first = 0;
    int last = -1;
  };
  template <typename Pixel, typename OnPixel>
  void compare(const Stream& stream, const cv::Mat& now, const OnPixel& on_pixel) const;
  template <typename Pixel>
  void take_in_pair(const Stream& stream, const cv::Mat& now);
  Gate take_in_level(std::size_t level);

  std::vector<Stream> streams_;
  std::array<Level, kLevels> levels_{};
  int full_scale_dn_ = 0;
  int images_ = 0;

  // Of the pair at hand.
  int step_ = 1;                          // DN to a bin of differences.
  std::vector<std::uint32_t> histogram_;  // [level][difference].
};

}  // namespace striper
