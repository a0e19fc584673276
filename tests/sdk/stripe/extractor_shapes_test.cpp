// SPDX-License-Identifier: Apache-2.0
// Proves that every method reads the pixels of its images and nothing else, on every instruction
// set of this machine: images of 1x1 to 200x100 pixels that end, or begin, where memory does, each
// with a stride of its own; both axes and depths, with and without a dark image, a mask and
// variances; flat, clipped and noisy ones. And that what is reported is finite and inside the
// image, and what is called good no less certain than that. Does not prove that it is right: see
// the other tests of this folder.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/stripe/extractor.hpp>

#include "support/guarded_image.hpp"
#include "support/instruction_sets.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using testing::GuardedImage;

int any_of(int count) { return static_cast<int>(testing::random_generator()() % count); }
bool perhaps() { return any_of(2) == 0; }

enum class Content { kFlat, kClipped, kAnything, kStripe, kClippedStripe };

struct Shape {
  int rows = 1;
  int cols = 1;
  bool is_16_bit = false;
  int full_scale_dn = 255;
  Content content = Content::kFlat;
  bool has_dark = false;
  bool has_masked = false;
  bool has_variance = false;
  ExtractOptions options;
};

void PrintTo(const Shape& s, std::ostream* out) {
  *out << s.cols << 'x' << s.rows << " full scale " << s.full_scale_dn << ", content "
       << static_cast<int>(s.content) << (s.has_dark ? " dark" : "")
       << (s.has_masked ? " masked" : "") << (s.has_variance ? " variance" : "") << ", method "
       << static_cast<int>(s.options.method) << " axis "
       << static_cast<int>(StripeAxis{s.options.axis}) << " peak "
       << static_cast<int>(s.options.peak) << " width " << s.options.stripe_sigma_px.value_or(0.0)
       << (s.options.noise ? " noise" : "");
}

Shape any_shape() {
  constexpr std::array kMethods{ExtractMethod::kPaper, ExtractMethod::kFast,
                                ExtractMethod::kRefined};
  constexpr std::array kRules{PeakRule::kBrightest, PeakRule::kNearest, PeakRule::kFarthest,
                              PeakRule::kContinuous, PeakRule::kAll};
  constexpr std::array kWidths{0.3, 0.7, 1.5, 4.0, 12.0, 80.0, 1000.0};
  Shape s;
  s.rows = 1 + any_of(perhaps() ? 100 : 40);
  s.cols = 1 + any_of(perhaps() ? 200 : 40);
  s.is_16_bit = perhaps();
  s.full_scale_dn = !s.is_16_bit ? 255 : perhaps() ? 4095 : 65535;
  s.content = static_cast<Content>(any_of(5));
  s.has_dark = perhaps();
  s.has_masked = any_of(3) == 0;
  s.has_variance = any_of(3) == 0;
  s.options.method = kMethods[static_cast<std::size_t>(any_of(3))];
  s.options.peak = kRules[static_cast<std::size_t>(any_of(5))];
  s.options.axis = perhaps() ? StripeAxis::kColumns : StripeAxis::kRows;
  if (any_of(3) == 0) s.options.stripe_sigma_px = kWidths[static_cast<std::size_t>(any_of(7))];
  if (any_of(3) == 0) s.options.noise = NoiseModel{1.5, 0.02, 4.0};
  return s;
}

// The images of a shape, each against a guard.
struct Images {
  GuardedImage lit, dark, masked, variance;

  explicit Images(const Shape& s) {
    const int type = s.is_16_bit ? CV_16UC1 : CV_8UC1;
    lit = guarded(s, type);
    if (s.has_dark) dark = guarded(s, type);
    if (s.has_masked) masked = guarded(s, CV_8UC1);
    if (s.has_variance) variance = guarded(s, CV_32FC1);
  }

  static GuardedImage guarded(const Shape& s, int type) {
    const auto pixel = static_cast<std::size_t>(CV_ELEM_SIZE(type));
    const std::size_t stride = (static_cast<std::size_t>(s.cols) + any_of(20)) * pixel;
    using Against = GuardedImage::Against;
    return {s.rows, s.cols, type, stride, perhaps() ? Against::kFirst : Against::kLast};
  }

  // Of the lit image, a stripe where there is one, across the middle.
  static double light(const Shape& s, int row, int col) {
    const double full = s.full_scale_dn;
    const bool columns = s.options.axis == StripeAxis::kColumns;
    const double t = columns ? (row - 0.5 * s.rows - 0.1 * col) : (col - 0.5 * s.cols - 0.1 * row);
    const double stripe = std::exp(-0.5 * t * t / 2.0);
    switch (s.content) {
      case Content::kFlat:
        return 0.1 * full;
      case Content::kClipped:
        return full;
      case Content::kAnything:
        return testing::uniform(0.0, full);
      case Content::kStripe:
        return 0.1 * full + 0.5 * full * stripe + testing::normal(0.0, 0.01 * full);
      case Content::kClippedStripe:
        break;
    }
    return 0.1 * full + 3.0 * full * stripe + testing::normal(0.0, 0.01 * full);
  }

  static void set(const cv::Mat& image, int row, int col, double dn) {
    cv::Mat writable = image;
    const double whole = std::clamp(std::round(dn), 0.0, image.depth() == CV_8U ? 255.0 : 65535.0);
    if (image.depth() == CV_8U) {
      writable.at<std::uint8_t>(row, col) = static_cast<std::uint8_t>(whole);
    } else {
      writable.at<std::uint16_t>(row, col) = static_cast<std::uint16_t>(whole);
    }
  }

  void draw(const Shape& s) {
    const double full = s.full_scale_dn;
    for (int row = 0; row < s.rows; ++row) {
      for (int col = 0; col < s.cols; ++col) {
        set(lit.image(), row, col, std::min(full, light(s, row, col)));
        if (s.has_dark) set(dark.image(), row, col, testing::uniform(0.0, 0.12 * full));
        if (s.has_masked) set(masked.image(), row, col, any_of(12) == 0 ? 255.0 : 0.0);
        if (s.has_variance) {
          cv::Mat(variance.image()).at<float>(row, col) =
              any_of(4) == 0 ? static_cast<float>(testing::uniform(0.0, full)) : 0.0F;
        }
      }
    }
  }

  void fill_gaps(std::uint8_t value) {
    for (GuardedImage* image : {&lit, &dark, &masked, &variance}) image->fill_gaps(value);
  }

  LitFrame frame(const Shape& s) const {
    LitFrame frame;
    frame.lit = lit.image();
    frame.dark = dark.image();
    frame.masked = masked.image();
    frame.variance = variance.image();
    frame.full_scale_dn = s.full_scale_dn;
    return frame;
  }
};

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void expect_same(const Stripe& a, const Stripe& b) {
  ASSERT_EQ(a.line, b.line);
  ASSERT_EQ(a.status, b.status);
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_TRUE(same(a.across_px[i], b.across_px[i])) << i;
    ASSERT_TRUE(same(a.sigma_px[i], b.sigma_px[i])) << i;
    ASSERT_TRUE(same(a.amplitude_dn[i], b.amplitude_dn[i])) << i;
    ASSERT_TRUE(same(a.width_px[i], b.width_px[i])) << i;
    ASSERT_TRUE(same(a.confidence[i], b.confidence[i])) << i;
  }
}

void expect_sound(const Shape& s, const Stripe& stripe) {
  const bool columns = s.options.axis == StripeAxis::kColumns;
  const double last = (columns ? s.rows : s.cols) - 1;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    ASSERT_LT(stripe.line[i], columns ? s.cols : s.rows);
    const bool is_missing = verdict(stripe.status[i]) == Verdict::kMissing;
    ASSERT_EQ(is_missing, std::isnan(stripe.across_px[i])) << i;
    if (is_missing) continue;
    ASSERT_GE(stripe.across_px[i], -0.5) << i;
    ASSERT_LE(stripe.across_px[i], last + 0.5) << i;
    ASSERT_GT(stripe.sigma_px[i], 0.0F) << i;
    ASSERT_TRUE(std::isfinite(stripe.sigma_px[i])) << i;
    const bool is_known = stripe.status[i] == ReturnStatus::kOk;
    ASSERT_LT(is_known ? stripe.sigma_px[i] : 0.0F, 20.0F) << i;
    ASSERT_TRUE(std::isfinite(stripe.amplitude_dn[i])) << i;
    ASSERT_GT(stripe.width_px[i], 0.0F) << i;
    ASSERT_GE(stripe.confidence[i], 0.0F) << i;
    ASSERT_LE(stripe.confidence[i], 1.0F) << i;
  }
}

// Two frames, so that what was learnt of the first one is used as well.
void extract_all(const Shape& s, Images& images) {
  std::array<Stripe, 2> stripes;
  for (const int run : {0, 1}) {
    images.fill_gaps(run == 0 ? 0 : 255);
    const auto extractor = make_extractor(s.options);
    for (int frame = 0; frame < 2; ++frame) {
      extractor->extract(images.frame(s), stripes[static_cast<std::size_t>(run)]);
    }
  }
  expect_sound(s, stripes[0]);
  expect_same(stripes[0], stripes[1]);
}

TEST(ExtractorShapes, ReadNothingButTheirPixels) {
  for (int n = 0; n < 200; ++n) {
    const Shape s = any_shape();
    Images images(s);
    images.draw(s);
    testing::for_each_instruction_set([&] { extract_all(s, images); });
    if (HasFatalFailure()) FAIL() << n << ": " << ::testing::PrintToString(s);
  }
}

}  // namespace
}  // namespace striper
