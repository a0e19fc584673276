// SPDX-License-Identifier: Apache-2.0
// Proves that images of any size, down to a single pixel, grey or in colour, whole or of two
// fields, go through the ambient stage and the methods that find the stripe; and that what a lit
// frame consists of is of one size. Built with a sanitizer it proves that they read nothing else.
// Does not prove that the answers are right: see the other tests of this folder.
#include <algorithm>
#include <array>
#include <cstdint>
#include <ostream>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

int any_of(int count) { return static_cast<int>(testing::random_generator()() % count); }
bool perhaps() { return any_of(2) == 0; }

struct Shape {
  int rows = 1;
  int cols = 1;
  int type = CV_8UC1;
  int bit_depth = 8;
  Field field = Field::kProgressive;
  AmbientOptions ambient;
  ExtractOptions extract;
};

void PrintTo(const Shape& s, std::ostream* out) {
  *out << s.cols << 'x' << s.rows << " type " << s.type << " field " << static_cast<int>(s.field)
       << " ambient " << to_string(s.ambient.method) << " pattern " << s.ambient.pattern.to_string()
       << " axis " << static_cast<int>(s.ambient.axis);
}

Shape any_shape() {
  constexpr std::array kTypes{CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3};
  constexpr std::array kFields{Field::kProgressive, Field::kInterlacedTopFirst,
                               Field::kInterlacedBottomFirst};
  constexpr std::array kMethods{AmbientMethod::kAuto, AmbientMethod::kNone,
                                AmbientMethod::kAlternate, AmbientMethod::kFields,
                                AmbientMethod::kTemporal};
  constexpr std::array kPatterns{"auto", "0,dark", "0,0,dark", "0,1,dark"};
  Shape s;
  s.rows = 1 + any_of(perhaps() ? 90 : 12);
  s.cols = 1 + any_of(perhaps() ? 90 : 12);
  s.type = kTypes[static_cast<std::size_t>(any_of(4))];
  s.bit_depth = CV_MAT_DEPTH(s.type) == CV_8U ? 8 : perhaps() ? 12 : 16;
  s.field = kFields[static_cast<std::size_t>(any_of(3))];
  s.ambient.method = kMethods[static_cast<std::size_t>(any_of(5))];
  s.ambient.pattern = IlluminationPattern::parse(kPatterns[static_cast<std::size_t>(any_of(4))]);
  s.ambient.lasers = any_of(3);
  s.ambient.axis = perhaps() ? StripeAxis::kColumns : StripeAxis::kRows;
  if (any_of(3) == 0) s.ambient.noise = NoiseModel{1.5, 0.02, 4.0};
  s.extract.axis = s.ambient.axis;
  s.extract.method = perhaps() ? ExtractMethod::kFast : ExtractMethod::kPaper;
  s.extract.peak = perhaps() ? PeakRule::kContinuous : PeakRule::kBrightest;
  return s;
}

// Noise, light sources, and every other exposure a bright stripe across.
Frame frame_of(const Shape& s, std::uint64_t sequence) {
  Frame frame;
  frame.image = cv::Mat(s.rows, s.cols, s.type);
  frame.bit_depth = s.bit_depth;
  frame.sensor_size = frame.image.size();
  frame.sequence = sequence;
  frame.field = s.field;
  const int per_frame = frame.is_interlaced() ? 2 : 1;
  frame.exposures_per_picture = per_frame;
  const double full = frame.full_scale_dn();
  const int channels = frame.image.channels();
  for (int row = 0; row < s.rows; ++row) {
    for (int i = 0; i < s.cols * channels; ++i) {
      const int across = s.ambient.axis == StripeAxis::kColumns ? row : i / channels;
      const int length = s.ambient.axis == StripeAxis::kColumns ? s.rows : s.cols;
      const bool is_lit = (static_cast<int>(sequence) * per_frame + row % per_frame) % 2 == 0;
      double dn = 0.2 * full + testing::normal(0.0, 0.02 * full);
      if (is_lit && across / 3 == length / 6) dn += 0.6 * full;
      if (any_of(150) == 0) dn = full;
      dn = std::clamp(dn, 0.0, full);
      if (s.bit_depth == 8) {
        frame.image.ptr<std::uint8_t>(row)[i] = static_cast<std::uint8_t>(dn);
      } else {
        frame.image.ptr<std::uint16_t>(row)[i] = static_cast<std::uint16_t>(dn);
      }
    }
  }
  return frame;
}

void expect_of_one_size(const LitFrame& lit) {
  ASSERT_FALSE(lit.lit.empty());
  for (const cv::Mat* const image : {&lit.dark, &lit.variance, &lit.masked}) {
    if (image->empty()) continue;
    ASSERT_EQ(image->size(), lit.lit.size());
  }
  ASSERT_TRUE(lit.dark.empty() || lit.dark.type() == lit.lit.type());
}

void run(const Shape& s) {
  AmbientStage stage(s.ambient);
  const auto extractor = make_extractor(s.extract);
  Stripe stripe;
  const auto take_all = [&] {
    while (const LitFrame* const lit = stage.next()) {
      expect_of_one_size(*lit);
      extractor->extract(*lit, stripe);
    }
  };
  std::uint64_t sequence = 0;
  for (int n = 0; n < 9; ++n) {
    stage.push(frame_of(s, sequence));
    sequence += any_of(6) == 0 ? 2 : 1;
    take_all();
  }
  stage.finish();
  take_all();
}

TEST(AmbientStageShapes, GoThrough) {
  for (int n = 0; n < 200; ++n) {
    const Shape s = any_shape();
    run(s);
    if (HasFatalFailure()) FAIL() << n << ": " << ::testing::PrintToString(s);
  }
}

}  // namespace
}  // namespace striper
