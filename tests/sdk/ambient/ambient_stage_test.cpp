// SPDX-License-Identifier: Apache-2.0
// Proves that lit and dark exposures are paired right whatever is lost on the way, and that nothing
// is allocated once warm. How the pattern is found and doubted: found_pattern_test.cpp; of a source
// that is opened again: reopened_source_test.cpp; what is subtracted: subtraction_test.cpp; what
// people are told: advice_test.cpp and given_pattern_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/ambient/fields.hpp>
#include <striper/core/error.hpp>

#include "support/allocation_counter.hpp"
#include "support/stage_pairs.hpp"
#include "support/street.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using testing::Street;
using testing::tagged;
using testing::take;
using testing::with_pattern;
using Pair = testing::StagePair;
using Pairs = testing::StagePairs;

Pairs pairs_of(const char* pattern, const std::vector<std::uint64_t>& arrived,
               AmbientMethod method = AmbientMethod::kAuto) {
  AmbientOptions options = with_pattern(pattern);
  options.method = method;
  AmbientStage stage(options);
  Pairs pairs;
  for (const std::uint64_t sequence : arrived) {
    stage.push(tagged(sequence, options.pattern));
    take(stage, pairs);
  }
  stage.finish();
  take(stage, pairs);
  return pairs;
}

TEST(AmbientStage, LitExposureIsFreedOfTheMeanOfItsDarkNeighbours) {
  EXPECT_EQ(pairs_of("0,dark", {10, 11, 12, 13, 14}),
            (Pairs{{10, 0, 11}, {12, 0, 12}, {14, 0, 13}}));
}

TEST(AmbientStage, SeveralLasersAreFreedOfWhatTimeMakesOfTheDarkOnes) {
  EXPECT_EQ(pairs_of("0,1,2,dark", {3, 4, 5, 6, 7}), (Pairs{{4, 0, 4}, {5, 1, 5}, {6, 2, 6}}));
}

TEST(AmbientStage, OneSideIsEnoughWhereTheOtherIsLost) {
  EXPECT_EQ(pairs_of("0,dark", {10, 12, 13, 14, 16}), (Pairs{{12, 0, 13}, {14, 0, 13}}));
}

TEST(AmbientStage, NothingFurtherAwayStandsInForALostNeighbour) {
  EXPECT_EQ(pairs_of("0,dark", {11, 14, 17}), (Pairs{}));
}

TEST(AmbientStage, SecondOfTwoDarkExposuresIsNoNeighbourOfTheNextButOne) {
  EXPECT_EQ(pairs_of("0,dark,dark", {0, 1, 2, 3, 5, 6}), (Pairs{{0, 0, 1}, {3, 0, 2}, {6, 0, 5}}));
}

TEST(AmbientStage, NoneSubtractsNothingAndStillSkipsTheDarkOnes) {
  EXPECT_EQ(pairs_of("0,dark", {10, 11, 12}, AmbientMethod::kNone),
            (Pairs{{10, 0, -1}, {12, 0, -1}}));
}

TEST(AmbientStage, AlwaysOnIsHandedThroughAtOnce) {
  AmbientStage stage(with_pattern("0"));
  stage.push(tagged(5, IlluminationPattern::parse("0")));
  Pairs pairs;
  take(stage, pairs);
  EXPECT_EQ(pairs, (Pairs{{5, 0, -1}}));
}

// Every frame that is lost must leave only pairs of true neighbours: `tagged` tells.
TEST(AmbientStage, NeverPairsAcrossALoss) {
  testing::reseed();
  for (const char* const text : {"0,dark", "dark,0", "0,0,dark", "0,1,2,dark", "0,dark,dark"}) {
    const IlluminationPattern pattern = IlluminationPattern::parse(text);
    std::vector<std::uint64_t> arrived;
    for (std::uint64_t sequence = 0; sequence < 97; ++sequence) {
      const bool in_burst = sequence >= 40 && sequence < 50;
      if (!in_burst && testing::uniform(0.0, 1.0) > 1.0 / 3.0) arrived.push_back(sequence);
    }
    const auto has = [&](std::uint64_t n) {
      return std::find(arrived.begin(), arrived.end(), n) != arrived.end();
    };
    std::size_t expected = 0;
    for (const std::uint64_t n : arrived) {
      if (pattern.at(n).is_dark()) continue;
      std::uint64_t after = n;
      std::uint64_t before = n + 12;  // A whole number of periods later.
      while (!pattern.at(after).is_dark()) ++after;
      while (!pattern.at(before).is_dark()) --before;
      if (has(after) || has(before - 12)) ++expected;
    }
    const Pairs pairs = pairs_of(text, arrived);
    EXPECT_EQ(pairs.size(), expected) << text;
    for (const Pair& pair : pairs) {
      EXPECT_TRUE(pattern.at(pair.lit).is_lit()) << text << ' ' << pair.lit;
      EXPECT_EQ(pair.laser, pattern.at(pair.lit).laser_index()) << text << ' ' << pair.lit;
      // Dark exposures hold their number, so a mean in time is the lit one's number, and one side
      // alone is at most three off.
      EXPECT_NEAR(pair.dark_value, static_cast<double>(pair.lit), 3.0) << text << ' ' << pair.lit;
    }
  }
}

// The same where every exposure is a field: rows of the other parity may serve, the place in time
// may not change.
TEST(AmbientStage, NeverPairsFieldsAcrossALoss) {
  testing::reseed();
  for (const char* const text : {"0,dark", "dark,0", "0,dark,dark", "0,1,2,dark"}) {
    const IlluminationPattern pattern = IlluminationPattern::parse(text);
    AmbientStage stage(with_pattern(text));
    int pairs = 0;
    const auto check = [&] {
      while (const LitFrame* const lit = stage.next()) {
        const std::uint64_t number = 2 * lit->sequence + (lit->field == Field::kBottom ? 1 : 0);
        EXPECT_EQ(lit->laser, pattern.at(number).laser_index()) << text << ' ' << number;
        EXPECT_NEAR(static_cast<double>(lit->dark.at<std::uint8_t>(3, 3)),
                    static_cast<double>(number), 3.0)
            << text;
        ++pairs;
      }
    };
    for (std::uint64_t number = 0; number < 97; ++number) {
      const bool in_burst = number >= 40 && number < 50;
      if (in_burst || testing::uniform(0.0, 1.0) < 1.0 / 3.0) continue;
      Frame frame = tagged(number, pattern);
      frame.sequence = number / 2;
      frame.exposure_in_picture = static_cast<int>(number % 2);
      frame.exposures_per_picture = 2;
      frame.field = number % 2 == 0 ? Field::kTop : Field::kBottom;
      frame.grid = number % 2 == 0 ? PixelGrid::top_field() : PixelGrid::bottom_field();
      stage.push(frame);
      check();
    }
    stage.finish();
    check();
    EXPECT_GT(pairs, 10) << text;
  }
}

TEST(AmbientStage, FramesOwnIlluminationWins) {
  AmbientStage stage{AmbientOptions{}};
  Pairs pairs;
  const IlluminationPattern pattern = IlluminationPattern::parse("dark,1");
  for (std::uint64_t sequence = 0; sequence < 9; ++sequence) {
    Frame frame = tagged(sequence, pattern);
    frame.illumination = pattern.at(sequence);
    stage.push(frame);
    take(stage, pairs);
  }
  EXPECT_EQ(pairs, (Pairs{{1, 1, 1}, {3, 1, 3}, {5, 1, 5}, {7, 1, 7}}));
}

TEST(AmbientStage, MethodThatNeedsDarkExposuresRefusesAPatternWithoutAny) {
  AmbientOptions options = with_pattern("0");
  options.method = AmbientMethod::kAlternate;
  EXPECT_THROW(
      {
        try {
          AmbientStage stage(options);
        } catch (const Error& error) {
          EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
          EXPECT_THAT(error.what(), HasSubstr("alternate"));
          EXPECT_THAT(error.what(), HasSubstr("'0'"));
          throw;
        }
      },
      Error);
}

TEST(AmbientStage, BuffersThatNobodyKeepsAreCopied) {
  AmbientStage stage(with_pattern("0,dark"));
  std::vector<std::uint8_t> memory(32 * 48);
  Pairs pairs;
  for (std::uint64_t sequence = 0; sequence < 3; ++sequence) {
    std::fill(memory.begin(), memory.end(), static_cast<std::uint8_t>(10 * (sequence + 1)));
    Frame frame;
    frame.image = cv::Mat(32, 48, CV_8UC1, memory.data());
    frame.sensor_size = frame.image.size();
    frame.sequence = sequence;
    stage.push(frame);
    take(stage, pairs);
  }
  stage.finish();
  take(stage, pairs);
  EXPECT_EQ(pairs, (Pairs{{0, 0, 20}, {2, 0, 20}}));
}

// ---- Channels.

// The first pixel of the first exposure that comes out, of images of blue 10, green 20, red 30.
std::pair<int, int> first_lit_and_dark(const char* pattern, AmbientOptions options) {
  options.pattern = IlluminationPattern::parse(pattern);
  AmbientStage stage(options);
  for (std::uint64_t sequence = 0; sequence < 4; ++sequence) {
    Frame frame = tagged(sequence, options.pattern);
    frame.image = cv::Mat(frame.image.size(), CV_8UC3, cv::Scalar(10, 20, 30));
    stage.push(frame);
  }
  stage.finish();
  const LitFrame* const lit = stage.next();
  if (lit == nullptr) return {-1, -1};
  return {lit->lit.at<std::uint8_t>(0, 0), lit->dark.empty() ? -1 : lit->dark.at<std::uint8_t>(0)};
}

TEST(AmbientStage, TakesTheChannelForDifferencesOnlyWhereADarkExposureIsSubtracted) {
  AmbientOptions options;
  options.channel = Channel::kGreen;
  options.difference_channel = Channel::kRed;
  EXPECT_EQ(first_lit_and_dark("0,dark", options), std::pair(30, 30));
  EXPECT_EQ(first_lit_and_dark("0", options), std::pair(20, -1));
  options.method = AmbientMethod::kNone;
  EXPECT_EQ(first_lit_and_dark("0,dark", options), std::pair(20, -1));
}

TEST(AmbientStage, TakesTheColourOfADifferenceWhereADarkExposureIsSubtracted) {
  AmbientOptions options;
  options.channel = Channel::kGreenMinusRed;
  EXPECT_EQ(first_lit_and_dark("0", options), std::pair(20, 30));
  EXPECT_EQ(first_lit_and_dark("0,dark", options), std::pair(20, 20));
  options.difference_channel = Channel::kRedMinusGreen;
  EXPECT_EQ(first_lit_and_dark("0,dark", options), std::pair(30, 30));
}

// ---- Cost.

class WarmStage : public ::testing::TestWithParam<int> {};

TEST_P(WarmStage, AllocatesNothing) {
  for (const Field order : {Field::kProgressive, Field::kInterlacedTopFirst}) {
    testing::reseed();
    Street street;
    street.field = order;
    street.speed_px = 5.0;
    street.light_sources = {{250.0, 60.0, 5.0}};
    street.build();
    std::vector<Frame> exposures;
    for (std::uint64_t sequence = 0; sequence < 30; ++sequence) {
      Frame frame = street.frame(sequence);
      cv::merge(std::vector<cv::Mat>(static_cast<std::size_t>(GetParam()), frame.image),
                frame.image);
      for_each_exposure(frame, [&](const Frame& exposure) { exposures.push_back(exposure); });
    }
    // The source knows: nothing is to be looked for in the images.
    for (Frame& exposure : exposures) {
      exposure.illumination = street.pattern.at(exposure.exposure_number());
    }
    AmbientOptions options = with_pattern("0,dark");
    options.channel = GetParam() == 3 ? Channel::kGreen : Channel::kAuto;
    AmbientStage stage(options);
    std::uint64_t allocations = 0;
    for (std::size_t i = 0; i < exposures.size(); ++i) {
      const testing::AllocationCounter counter;
      stage.push(exposures[i]);
      while (stage.next() != nullptr) {
      }
      if (i >= 20) allocations += counter.count();
    }
    EXPECT_EQ(allocations, 0U);
  }
}

INSTANTIATE_TEST_SUITE_P(AmbientStage, WarmStage, ::testing::Values(1, 3),
                         [](const auto& channels) {
                           return channels.param == 1 ? "Grey" : "Colour";
                         });

// An empty street: images neither confirm nor refute what was given, and are asked again.
TEST(AmbientStage, AsksTheImagesAgainWithoutAllocating) {
  for (const Field order : {Field::kProgressive, Field::kInterlacedTopFirst}) {
    testing::reseed();
    Street street;
    street.field = order;
    street.size = {160, 120};
    street.amplitude_dn = 0.0;
    street.speed_px = 5.0;
    street.build();
    AmbientStage stage(with_pattern("0"));
    std::uint64_t allocations = 0;
    for (std::uint64_t sequence = 0; sequence < 100; ++sequence) {
      const Frame frame = street.frame(sequence);
      const testing::AllocationCounter counter;
      stage.push(frame);
      while (stage.next() != nullptr) {
      }
      if (sequence >= 30) allocations += counter.count();
    }
    EXPECT_EQ(allocations, 0U);
  }
}

}  // namespace
}  // namespace striper
