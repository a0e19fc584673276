// SPDX-License-Identifier: Apache-2.0
// Proves that the profile kernel measures, on every instruction set of this machine, what a plain
// loop over one profile's pixels measures: every number of seeds that fills a vector or not, odd
// strides, 8 and 16 bit, both methods, with a dark image, a mask, variances, clipped pixels
// and at the borders. That what is measured is right is proven in stripe_accuracy_test.cpp.
#include "stripe/profile/profile_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <striper/core/stripe_axis.hpp>

#include "stripe/profile/profile_plan.hpp"
#include "support/instruction_sets.hpp"
#include "support/plain_profile.hpp"
#include "support/random.hpp"

namespace striper::detail {
namespace {

using testing::PlainProfile;
using Images = PlainProfile::Images;

struct Case {
  std::string name;
  int type = CV_8UC1;
  bool refine = true;
  bool has_dark = false;
  bool has_masked = false;
  bool has_variance = false;
  bool is_clipped = false;
  double slope = 0.3;  // Pixels that the stripe climbs per column.
  double width = 1.3;
  StripeAxis axis = StripeAxis::kColumns;
};

constexpr int kRows = 61;

double centre_of(const Case& c, int column) { return 9.0 + std::fmod(c.slope * column, 44.0); }

// A noisy stripe on a ramp, inside a larger buffer so that rows do not follow one another.
cv::Mat noisy_image(const Case& c, int columns, double stripe_dn, double background_dn) {
  const double scale = c.type == CV_8UC1 ? 1.0 : 16.0;
  const double full = c.type == CV_8UC1 ? 255.0 : 4095.0;
  cv::Mat buffer(kRows, columns + 7, c.type, cv::Scalar(full));
  cv::Mat image = buffer.colRange(5, 5 + columns);
  for (int row = 0; row < kRows; ++row) {
    for (int col = 0; col < columns; ++col) {
      const double t = (row - centre_of(c, col)) / c.width;
      const double light = background_dn + 0.2 * row + stripe_dn * std::exp(-0.5 * t * t);
      const double dn = std::clamp(std::round(scale * testing::normal(light, 2.0)), 0.0, full);
      if (c.type == CV_8UC1) {
        image.at<std::uint8_t>(row, col) = static_cast<std::uint8_t>(dn);
      } else {
        image.at<std::uint16_t>(row, col) = static_cast<std::uint16_t>(dn);
      }
    }
  }
  return image;
}

Images images_of(const Case& c, int columns) {
  Images p;
  p.full_scale_dn = c.type == CV_8UC1 ? 255 : 4095;
  p.lit = noisy_image(c, columns, c.is_clipped ? 500.0 : 120.0, 40.0);
  if (c.has_dark) p.dark = noisy_image(c, columns, 0.0, 20.0);
  if (c.has_masked) {
    p.masked = cv::Mat::zeros(kRows, columns, CV_8UC1);
    for (int n = 0; n < columns; ++n) {
      const int row = static_cast<int>(testing::uniform(0.0, kRows));
      p.masked.at<std::uint8_t>(row, static_cast<int>(testing::uniform(0.0, columns))) = 255;
    }
  }
  if (c.has_variance) {
    p.variance = cv::Mat::zeros(kRows, columns, CV_32FC1);
    for (int n = 0; n < 20 * columns; ++n) {
      const int row = static_cast<int>(testing::uniform(0.0, kRows));
      const int col = static_cast<int>(testing::uniform(0.0, columns));
      p.variance.at<float>(row, col) = static_cast<float>(testing::uniform(0.0, 30.0));
    }
  }
  return p;
}

// The seed of every column, and a few anywhere.
std::vector<PeakSeed> seeds_of(const Case& c, int columns) {
  std::vector<PeakSeed> seeds;
  for (int col = 0; col < columns; ++col) {
    const double at = centre_of(c, col) + testing::uniform(-1.5, 1.5);
    seeds.push_back({col, std::clamp(static_cast<int>(std::lround(at)), 0, kRows - 1)});
  }
  for (int n = 0; n < columns / 5; ++n) {
    seeds.push_back({static_cast<int>(testing::uniform(0.0, columns)),
                     static_cast<int>(testing::uniform(0.0, kRows))});
  }
  return seeds;
}

template <typename Pixel>
const Pixel* start_of(const cv::Mat& image, StripeAxis axis, cv::Mat& turned,
                      ProfileImages::Steps& steps) {
  if (image.empty()) return nullptr;
  turned = axis == StripeAxis::kColumns ? image : cv::Mat(image.t());
  const auto stride = static_cast<std::ptrdiff_t>(turned.step1());
  steps = axis == StripeAxis::kColumns ? ProfileImages::Steps{1, stride}
                                       : ProfileImages::Steps{stride, 1};
  return turned.ptr<Pixel>();
}

struct Measured {
  explicit Measured(std::size_t count)
      : across(count + PeakMeasurements::kMultiple),
        values(9, std::vector<float>(count + PeakMeasurements::kMultiple)) {}

  PeakMeasurements room() {
    return {across.data(),    values[0].data(), values[1].data(), values[2].data(),
            values[3].data(), values[4].data(), values[5].data(), values[6].data(),
            values[7].data(), values[8].data()};
  }

  std::vector<std::int32_t> across;
  std::vector<std::vector<float>> values;
};

Measured measure(const Case& c, const Images& p, const ProfilePlan& plan,
                 const std::vector<PeakSeed>& seeds) {
  ProfileImages images;
  cv::Mat lit;
  cv::Mat dark;
  cv::Mat masked;
  cv::Mat variance;
  images.is_16_bit = c.type == CV_16UC1;
  if (images.is_16_bit) {
    images.lit = start_of<std::uint16_t>(p.lit, c.axis, lit, images.lit_steps);
    images.dark = start_of<std::uint16_t>(p.dark, c.axis, dark, images.dark_steps);
  } else {
    images.lit = start_of<std::uint8_t>(p.lit, c.axis, lit, images.lit_steps);
    images.dark = start_of<std::uint8_t>(p.dark, c.axis, dark, images.dark_steps);
  }
  images.masked = start_of<std::uint8_t>(p.masked, c.axis, masked, images.masked_steps);
  images.variance = start_of<float>(p.variance, c.axis, variance, images.variance_steps);
  images.length = kRows;
  images.full_scale_dn = p.full_scale_dn;
  Measured measured(seeds.size());
  measure_profiles(images, plan, seeds.data(), static_cast<int>(seeds.size()), measured.room());
  return measured;
}

// Single precision at 4095 DN, and rough reciprocals in the weights.
bool is_close(double a, double b, double relative) {
  return std::abs(a - b) <= relative * std::max(std::abs(b), 1e-3);
}

// Whether one of the fits, of as many steps as the kernel may have taken, is what was measured.
bool agrees(const PlainProfile& plain, const Measured& m, std::size_t i, const ProfilePlan& plan) {
  const double position = m.across[i] + static_cast<double>(m.values[0][i]) - plain.centre();
  const std::size_t first = plan.refine ? 1 : 0;
  for (std::size_t n = first; n < plain.fits.size(); ++n) {
    const PlainProfile::Fit& fit = plain.fits[n];
    if (std::abs(position - fit.position) < 1e-3 + 0.01 * fit.sigma &&
        is_close(m.values[1][i], fit.amplitude, 5e-3) &&
        is_close(m.values[3][i], plain.sigma(fit), 1e-2) &&
        is_close(m.values[5][i], plain.snr(fit), 5e-3)) {
      return true;
    }
  }
  return false;
}

void expect_equal_to_oracle(const Case& c, const Images& p, const ProfilePlan& plan,
                            const std::vector<PeakSeed>& seeds) {
  const Measured m = measure(c, p, plan, seeds);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const PlainProfile plain(p, plan, seeds[i]);
    ASSERT_NEAR(m.values[4][i], plain.significance, 1e-2 + 2e-3 * std::abs(plain.significance))
        << "significance of " << i;
    // Where nothing stands out any pixel may be the highest one.
    if (plain.significance < 5.0) continue;
    ASSERT_EQ(m.across[i], plain.across) << i;
    ASSERT_EQ(m.values[6][i], plain.clipped) << "clipped pixels of " << i;
    ASSERT_TRUE(is_close(m.values[2][i], plain.width, 1e-2))
        << "width of " << i << ": " << m.values[2][i] << " " << plain.width;
    ASSERT_TRUE(agrees(plain, m, i, plan))
        << "fit of " << i << ": " << m.across[i] + m.values[0][i] - plain.centre() << " "
        << plain.fits.back().position << ", " << m.values[1][i] << " "
        << plain.fits.back().amplitude << ", " << m.values[3][i] << " "
        << plain.sigma(plain.fits.back());
  }
}

class ProfileKernel : public ::testing::TestWithParam<Case> {};

TEST_P(ProfileKernel, EqualsThePlainLoopOnEveryInstructionSet) {
  const Case& c = GetParam();
  const double scale = c.type == CV_8UC1 ? 1.0 : 16.0;
  PlanNoise noise;
  noise.model = {2.0 * scale, 0.02 * scale, 5.0 * scale};
  noise.speckle_contrast = 0.01;
  noise.dark_noise_gain = c.has_dark ? 0.5 : 0.0;
  for (int columns = 1; columns <= 70; columns += columns < 18 ? 1 : 13) {
    const auto reach = static_cast<BackgroundReach>(columns % 3);
    const ProfilePlan plan = plan_profile(WidthModel{c.width, 0.002, 20.0}, noise, c.refine, reach);
    const Images p = images_of(c, columns);
    const std::vector<PeakSeed> seeds = seeds_of(c, columns);
    testing::for_each_instruction_set([&] { expect_equal_to_oracle(c, p, plan, seeds); });
    if (HasFatalFailure()) FAIL() << columns << " columns";
  }
}

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  const auto add = [&](const std::string& name, auto change) {
    Case c;
    c.name = name;
    change(c);
    cases.push_back(c);
  };
  add("Refined", [](Case&) {});
  add("Fast", [](Case& c) { c.refine = false; });
  add("Level", [](Case& c) { c.slope = 0.0; });
  add("Steep", [](Case& c) { c.slope = 0.9; });
  add("TooSteepToReadSideBySide", [](Case& c) { c.slope = 3.7; });
  add("Wide", [](Case& c) { c.width = 3.1; });
  add("Bits16", [](Case& c) { c.type = CV_16UC1; });
  add("Dark", [](Case& c) { c.has_dark = true; });
  add("Bits16Dark", [](Case& c) { c.type = CV_16UC1, c.has_dark = true; });
  add("Masked", [](Case& c) { c.has_masked = true; });
  add("Variance", [](Case& c) { c.has_variance = true; });
  add("FastDarkBlindVariance", [](Case& c) {
    c.refine = false;
    c.has_dark = c.has_masked = c.has_variance = true;
  });
  add("Clipped", [](Case& c) { c.is_clipped = true, c.width = 2.0; });
  add("ClippedNarrow", [](Case& c) { c.is_clipped = true, c.width = 0.9; });
  add("ClippedMaskedRows", [](Case& c) {
    c.is_clipped = c.has_masked = true;
    c.axis = StripeAxis::kRows;
  });
  add("ClippedBits16Dark", [](Case& c) {
    c.is_clipped = c.has_dark = true;
    c.type = CV_16UC1;
  });
  add("Rows", [](Case& c) { c.axis = StripeAxis::kRows; });
  add("RowsBits16Dark", [](Case& c) {
    c.axis = StripeAxis::kRows;
    c.type = CV_16UC1;
    c.has_dark = true;
  });
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Oracle, ProfileKernel, ::testing::ValuesIn(all_cases()),
                         [](const auto& c) { return c.param.name; });

}  // namespace
}  // namespace striper::detail
