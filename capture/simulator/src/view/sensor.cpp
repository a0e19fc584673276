// SPDX-License-Identifier: Apache-2.0
#include "view/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <striper/core/frame.hpp>

#include "light/random.hpp"
#include "view/view.hpp"

namespace striper::detail {
namespace {

// Every noise has its own random numbers: switching one off leaves the others as they are.
enum Purpose : std::uint64_t { kShot, kRead, kSpeckle, kPrnu };

/// A pixel's number on the sensor: a region of interest has the noise of the whole.
std::uint64_t pixel_number(const Imager& imager, int column, int row) {
  return (static_cast<std::uint64_t>(imager.region.y + row * imager.binning.height) << 32U) +
         static_cast<std::uint64_t>(imager.region.x + column * imager.binning.width);
}

class ReadOut {
 public:
  ReadOut(const Charge& charge, const Imager& imager, std::uint64_t seed)
      : charge_(charge),
        imager_(imager),
        shot_(seed, kShot, charge.exposure_number),
        read_(seed, kRead, charge.exposure_number),
        speckle_(seed, kSpeckle, charge.exposure_number),
        full_well_e_(imager.full_well_e > 0.0 ? imager.full_well_e
                                              : std::numeric_limits<double>::infinity()),
        full_scale_dn_(full_scale_dn(imager.bit_depth)) {}

  template <typename Pixel>
  void row(int from, Pixel* to) const {
    const auto* const daylight = charge_.daylight.ptr<float>(from);
    const auto* const laser = charge_.laser.empty() ? nullptr : charge_.laser.ptr<float>(from);
    const auto* const gains = charge_.gains.empty() ? nullptr : charge_.gains.ptr<double>(from);
    for (int column = 0; column < charge_.daylight.cols; ++column) {
      const std::uint64_t pixel = pixel_number(imager_, column, from);
      double electrons = daylight[column];
      if (laser != nullptr && laser[column] > 0.0F) electrons += speckled(laser[column], pixel);
      if (gains != nullptr) electrons *= gains[column];
      const double dn =
          imager_.black_level_dn + imager_.dn_per_electron * measured(electrons, pixel);
      to[column] = static_cast<Pixel>(std::clamp(std::floor(dn + 0.5), 0.0, full_scale_dn_));
    }
  }

 private:
  double speckled(double electrons, std::uint64_t pixel) const {
    if (imager_.noise.speckle <= 0.0) return electrons;
    return electrons * std::max(0.0, 1.0 + imager_.noise.speckle * speckle_.of(pixel).normal());
  }

  double measured(double electrons, std::uint64_t pixel) const {
    const SensorNoise& noise = imager_.noise;
    if (noise.shot) electrons = shot_.of(pixel).poisson(electrons);
    electrons = std::min(electrons, full_well_e_);
    if (noise.read_noise_e > 0.0) electrons += noise.read_noise_e * read_.of(pixel).normal();
    return electrons;
  }

  const Charge& charge_;
  const Imager& imager_;
  RandomPixels shot_;
  RandomPixels read_;
  RandomPixels speckle_;
  double full_well_e_;
  double full_scale_dn_;
};

}  // namespace

cv::Mat binned(const cv::Mat& electrons, cv::Size binning) {
  if (binning == cv::Size(1, 1)) return electrons;
  cv::Mat result(electrons.rows / binning.height, electrons.cols / binning.width, CV_32FC1);
  for (int row = 0; row < result.rows; ++row) {
    for (int column = 0; column < result.cols; ++column) {
      double sum = 0.0;
      for (int j = 0; j < binning.height; ++j) {
        for (int i = 0; i < binning.width; ++i) {
          sum += electrons.at<float>(row * binning.height + j, column * binning.width + i);
        }
      }
      result.at<float>(row, column) = static_cast<float>(sum);
    }
  }
  return result;
}

cv::Mat pixel_gains(cv::Size image, const Imager& imager, std::uint64_t seed) {
  const double prnu = imager.noise.prnu;
  if (prnu <= 0.0) return {};
  const RandomPixels random(seed, kPrnu, 0);
  cv::Mat gains(image, CV_64FC1);
  for (int row = 0; row < gains.rows; ++row) {
    for (int column = 0; column < gains.cols; ++column) {
      PixelRandom pixel = random.of(pixel_number(imager, column, row));
      gains.at<double>(row, column) = std::max(0.0, 1.0 + prnu * pixel.normal());
    }
  }
  return gains;
}

cv::Mat bloomed(const cv::Mat& electrons, const Bloom& bloom) {
  if (bloom.fraction <= 0.0) return electrons;
  const cv::Mat flare = blurred(electrons, bloom.sigma_px);
  cv::Mat result(electrons.size(), CV_32FC1);
  const auto fraction = static_cast<float>(bloom.fraction);
  for (int row = 0; row < result.rows; ++row) {
    for (int column = 0; column < result.cols; ++column) {
      result.at<float>(row, column) = (1.0F - fraction) * electrons.at<float>(row, column) +
                                      fraction * flare.at<float>(row, column);
    }
  }
  return result;
}

void read_out(const Charge& charge, const Imager& imager, std::uint64_t seed, const RowRange& rows,
              cv::Mat& image) {
  const ReadOut sensor(charge, imager, seed);
  int to = rows.image_first;
  for (int from = rows.first; from < charge.daylight.rows; from += rows.step) {
    if (image.depth() == CV_8U) {
      sensor.row(from, image.ptr<std::uint8_t>(to));
    } else {
      sensor.row(from, image.ptr<std::uint16_t>(to));
    }
    to += rows.image_step;
  }
}

void read_out_expected(const Charge& charge, const Imager& imager, const RowRange& rows,
                       cv::Mat& image) {
  int to = rows.image_first;
  for (int from = rows.first; from < charge.daylight.rows; from += rows.step) {
    for (int column = 0; column < image.cols; ++column) {
      double electrons = charge.daylight.at<float>(from, column);
      if (!charge.laser.empty()) electrons += charge.laser.at<float>(from, column);
      image.at<float>(to, column) =
          static_cast<float>(imager.black_level_dn + imager.dn_per_electron * electrons);
    }
    to += rows.image_step;
  }
}

double saturation_electrons(const Imager& imager) noexcept {
  const double converter =
      (full_scale_dn(imager.bit_depth) - imager.black_level_dn) / imager.dn_per_electron;
  return imager.full_well_e > 0.0 ? std::min(imager.full_well_e, converter) : converter;
}

}  // namespace striper::detail
