// SPDX-License-Identifier: Apache-2.0
// Proves that the photon-transfer line is found to a few percent in images whose noise is known,
// at 8 and 12 bits, that its error bars are true, with something moving and the light changing, and
// that images which do not tell are refused with the reason. Real cameras' lines are not
// perfectly straight; this does not say how far.
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/core/frame.hpp>
#include <striper/stripe/photon_transfer.hpp>

#include "support/error_of.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

// A ramp of light from `low` to `high` DN and its noise.
struct Camera {
  cv::Size size{320, 200};
  double low_dn = 20.0;
  double high_dn = 200.0;
  NoiseModel noise{1.5, 0.08, 8.0};
  int bit_depth = 8;
  double light = 1.0;
  /// Between `low_dn` and `high_dn` by the place from left to right, 0 to 1.
  std::function<double(double)> shade = [](double place) { return place; };

  int full_scale_dn() const { return striper::full_scale_dn(bit_depth); }

  cv::Mat image() const {
    cv::Mat image(size, bit_depth > 8 ? CV_16UC1 : CV_8UC1);
    for (int v = 0; v < size.height; ++v) {
      for (int u = 0; u < size.width; ++u) {
        const double dn = light * (low_dn + (high_dn - low_dn) * shade(u / (size.width - 1.0)));
        const double variance = noise.variance_dn2(dn) - 1.0 / 12.0;
        const double value = std::clamp(std::round(testing::normal(dn, std::sqrt(variance))), 0.0,
                                        static_cast<double>(full_scale_dn()));
        if (bit_depth > 8) {
          image.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(value);
        } else {
          image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(value);
        }
      }
    }
    return image;
  }
};

PhotonTransferFit measure(const Camera& camera, int images) {
  PhotonTransfer transfer;
  for (int n = 0; n < images; ++n) transfer.add(camera.image(), camera.full_scale_dn());
  return transfer.fit(camera.noise.black_level_dn);
}

void expect_truth(const PhotonTransferFit& fit, const NoiseModel& truth) {
  EXPECT_NEAR(fit.noise.read_noise_dn, truth.read_noise_dn, 0.04 * truth.read_noise_dn);
  EXPECT_NEAR(fit.noise.dn_per_electron, truth.dn_per_electron, 0.03 * truth.dn_per_electron);
  EXPECT_LT(std::abs(fit.noise.read_noise_dn - truth.read_noise_dn),
            4.0 * fit.read_noise_sigma_dn + 0.01 * truth.read_noise_dn);
  EXPECT_LT(std::abs(fit.noise.dn_per_electron - truth.dn_per_electron),
            4.0 * fit.dn_per_electron_sigma + 0.01 * truth.dn_per_electron);
  EXPECT_EQ(fit.noise.black_level_dn, truth.black_level_dn);
}

TEST(PhotonTransfer, FindsReadNoiseAndDnPerElectron) {
  const Camera camera;
  const PhotonTransferFit fit = measure(camera, 12);
  expect_truth(fit, camera.noise);
  EXPECT_EQ(fit.pictures, 12);
  EXPECT_LT(fit.misfit, 0.05);
  EXPECT_NEAR(fit.lowest_dn, 20.0, 4.0);
  EXPECT_NEAR(fit.highest_dn, 200.0, 4.0);
}

TEST(PhotonTransfer, OfTwelveBits) {
  Camera camera;
  camera.bit_depth = 12;
  camera.low_dn *= 16.0;
  camera.high_dn *= 16.0;
  camera.noise = {24.0, 1.3, 128.0};
  expect_truth(measure(camera, 12), camera.noise);
}

// Mean and spread of (found - true) / bar.
struct Pulls {
  double sum = 0.0;
  double squares = 0.0;
  int count = 0;

  void add(double found, double truth, double bar) {
    const double pull = (found - truth) / bar;
    sum += pull;
    squares += pull * pull;
    ++count;
  }
  double mean() const { return sum / count; }
  double sd() const { return std::sqrt(squares / count - mean() * mean()); }
};

// Most of a room is of one brightness. Levels told by the compared images themselves are drawn
// towards it: in the simulated room the slope was 3 % off, sixteen times its bar.
TEST(PhotonTransfer, BarsAreTrueForASceneThatIsMostlyOfOneBrightness) {
  Camera camera;
  camera.size = {320, 72};
  camera.low_dn = 30.0;
  camera.high_dn = 90.0;
  camera.noise = {2.0, 0.05, 8.0};
  camera.shade = [](double place) { return place < 0.8 ? 0.2 * place : place < 0.9 ? 0.5 : 1.0; };
  Pulls read;
  Pulls gain;
  constexpr int kRuns = 300;  // They tell the spread to 4 %.
  for (int run = 0; run < kRuns; ++run) {
    const PhotonTransferFit fit = measure(camera, 8);
    read.add(fit.noise.read_noise_dn, camera.noise.read_noise_dn, fit.read_noise_sigma_dn);
    gain.add(fit.noise.dn_per_electron, camera.noise.dn_per_electron, fit.dn_per_electron_sigma);
  }
  for (const Pulls& pulls : {read, gain}) {
    EXPECT_NEAR(pulls.mean(), 0.0, 0.2);
    EXPECT_GT(pulls.sd(), 0.9);
    EXPECT_LT(pulls.sd(), 1.1);
  }
}

TEST(PhotonTransfer, WithoutReadOrShotNoise) {
  Camera camera;
  camera.noise = {2.0, 0.0, 0.0};
  EXPECT_NEAR(measure(camera, 8).noise.read_noise_dn, 2.0, 0.06);
  EXPECT_NEAR(measure(camera, 8).noise.dn_per_electron, 0.0, 0.002);
  camera.noise = {0.0, 0.1, 0.0};
  const PhotonTransferFit shot = measure(camera, 12);
  EXPECT_NEAR(shot.noise.dn_per_electron, 0.1, 0.003);
  EXPECT_LT(shot.noise.read_noise_dn, 0.45);
}

TEST(PhotonTransfer, BearsWhatMovesAndChangingLight) {
  Camera camera;
  PhotonTransfer transfer;
  for (int n = 0; n < 12; ++n) {
    camera.light = n % 2 == 0 ? 1.0 : 1.03;
    cv::Mat image = camera.image();
    image(cv::Rect(5 + 10 * n, 60, 12, 40)) = cv::Scalar(180);  // Somebody walks by.
    transfer.add(image, 255);
  }
  expect_truth(transfer.fit(camera.noise.black_level_dn), camera.noise);
}

TEST(PhotonTransfer, KeepsStreamsApart) {
  Camera even;
  Camera odd;
  odd.high_dn = 120.0;
  PhotonTransfer transfer;
  for (int n = 0; n < 8; ++n) {
    transfer.add(even.image(), 255, 0);
    transfer.add(odd.image(), 255, 1);
  }
  expect_truth(transfer.fit(even.noise.black_level_dn), even.noise);
}

void expect_refused(const std::function<void()>& action, ErrorKind kind, const std::string& why) {
  SCOPED_TRACE(why);
  const Error error = testing::error_of(action);
  EXPECT_EQ(error.kind(), kind) << error.what();
  EXPECT_THAT(error.what(), ::testing::HasSubstr(why));
}

TEST(PhotonTransfer, RefusesWhatDoesNotTell) {
  const auto refuses = [](const std::function<void(PhotonTransfer&)>& fill, double black_dn,
                          const std::string& why) {
    PhotonTransfer transfer;
    fill(transfer);
    expect_refused([&] { transfer.fit(black_dn); }, ErrorKind::kUntrustworthy, why);
  };
  const Camera camera;
  refuses([&](auto& t) { t.add(camera.image(), 255); }, 8.0, "1 dark images; at least 4");
  refuses(
      [&](auto& t) {
        const cv::Mat copy = camera.image();
        for (int n = 0; n < 8; ++n) t.add(copy, 255);
      },
      8.0, "all the same");
  refuses(
      [&](auto& t) {
        for (int n = 0; n < 8; ++n) t.add(cv::Mat(64, 64, CV_8UC1, cv::Scalar(255)), 255);
      },
      8.0, "between black and white");
  refuses(
      [&](auto& t) {
        Camera even = camera;
        even.low_dn = 60.0;
        even.high_dn = 61.0;
        for (int n = 0; n < 8; ++n) t.add(even.image(), 255);
      },
      8.0, "too even");
  refuses(
      [&](auto& t) {
        Camera shot = camera;
        shot.noise = {0.5, 0.2, 16.0};
        for (int n = 0; n < 8; ++n) t.add(shot.image(), 255);
      },
      0.0, "black level is higher");
  refuses(
      [&](auto& t) {
        for (int n = 0; n < 8; ++n) {
          cv::Mat image = camera.image();
          for (int v = 0; v < image.rows; ++v) {
            for (int u = 0; u < image.cols; ++u) {  // Gamma correction.
              auto& dn = image.at<std::uint8_t>(v, u);
              dn = static_cast<std::uint8_t>(std::lround(255.0 * std::pow(dn / 255.0, 0.45)));
            }
          }
          t.add(image, 255);
        }
      },
      0.0, "off its line");
}

TEST(PhotonTransfer, RefusesAnImageOfAnotherSize) {
  PhotonTransfer transfer;
  transfer.add(cv::Mat(10, 20, CV_8UC1, cv::Scalar(1)), 255);
  expect_refused([&] { transfer.add(cv::Mat(11, 20, CV_8UC1, cv::Scalar(1)), 255); },
                 ErrorKind::kBadValue, "20x11 pixels after one of 20x10");
}

}  // namespace
}  // namespace striper
