// SPDX-License-Identifier: Apache-2.0
// Proves that lit and dark exposures are paired right whatever is lost on the way, and that the
// cadence is found, doubted and found again. What is subtracted: subtraction_test.cpp; what people
// are told: advice_test.cpp and given_cadence_test.cpp.
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/ambient/fields.hpp>
#include <striper/core/error.hpp>

#include "support/allocation_counter.hpp"
#include "support/street.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::Street;

AmbientOptions with_cadence(const char* cadence) {
  AmbientOptions options;
  options.cadence = Cadence::parse(cadence);
  return options;
}

// A picture whose pixels tell its number and whether it is lit.
Frame tagged(std::uint64_t sequence, const Cadence& cadence) {
  Frame frame;
  frame.image = cv::Mat(32, 48, CV_8UC1);
  frame.image.setTo(cadence.at(sequence).is_dark() ? sequence % 100 : 100 + sequence % 100);
  frame.sensor_size = frame.image.size();
  frame.sequence = sequence;
  return frame;
}

struct Pair {
  std::uint64_t lit;
  int laser;
  int dark_value;  // -1: nothing subtracted.
};
bool operator==(const Pair& a, const Pair& b) {
  return a.lit == b.lit && a.laser == b.laser && a.dark_value == b.dark_value;
}
void PrintTo(const Pair& pair, std::ostream* out) {
  *out << pair.lit << " laser " << pair.laser << " minus " << pair.dark_value;
}

void take(AmbientStage& stage, std::vector<Pair>& pairs) {
  while (const LitFrame* const lit = stage.next()) {
    pairs.push_back({lit->sequence, lit->laser,
                     lit->dark.empty() ? -1 : static_cast<int>(lit->dark.at<std::uint8_t>(3, 3))});
  }
}

std::vector<Pair> pairs_of(const char* cadence, const std::vector<std::uint64_t>& arrived,
                           AmbientMethod method = AmbientMethod::kAuto) {
  AmbientOptions options = with_cadence(cadence);
  options.method = method;
  AmbientStage stage(options);
  std::vector<Pair> pairs;
  for (const std::uint64_t sequence : arrived) {
    stage.push(tagged(sequence, options.cadence));
    take(stage, pairs);
  }
  stage.finish();
  take(stage, pairs);
  return pairs;
}

using Pairs = std::vector<Pair>;

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
  AmbientStage stage(with_cadence("0"));
  stage.push(tagged(5, Cadence::parse("0")));
  std::vector<Pair> pairs;
  take(stage, pairs);
  EXPECT_EQ(pairs, (Pairs{{5, 0, -1}}));
}

// Every picture that is lost must leave only pairs of true neighbours: `tagged` tells.
TEST(AmbientStage, NeverPairsAcrossALoss) {
  testing::reseed();
  for (const char* const text : {"0,dark", "dark,0", "0,0,dark", "0,1,2,dark", "0,dark,dark"}) {
    const Cadence cadence = Cadence::parse(text);
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
      if (cadence.at(n).is_dark()) continue;
      std::uint64_t after = n;
      std::uint64_t before = n + 12;  // A whole number of periods later.
      while (!cadence.at(after).is_dark()) ++after;
      while (!cadence.at(before).is_dark()) --before;
      if (has(after) || has(before - 12)) ++expected;
    }
    const Pairs pairs = pairs_of(text, arrived);
    EXPECT_EQ(pairs.size(), expected) << text;
    for (const Pair& pair : pairs) {
      EXPECT_TRUE(cadence.at(pair.lit).is_lit()) << text << ' ' << pair.lit;
      EXPECT_EQ(pair.laser, cadence.at(pair.lit).laser_index()) << text << ' ' << pair.lit;
      // Dark pictures hold their number, so a mean in time is the lit one's number, and one side
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
    const Cadence cadence = Cadence::parse(text);
    AmbientStage stage(with_cadence(text));
    int pairs = 0;
    const auto check = [&] {
      while (const LitFrame* const lit = stage.next()) {
        const std::uint64_t number = 2 * lit->sequence + (lit->field == Field::kBottom ? 1 : 0);
        EXPECT_EQ(lit->laser, cadence.at(number).laser_index()) << text << ' ' << number;
        EXPECT_NEAR(static_cast<double>(lit->dark.at<std::uint8_t>(3, 3)),
                    static_cast<double>(number), 3.0)
            << text;
        ++pairs;
      }
    };
    for (std::uint64_t number = 0; number < 97; ++number) {
      const bool in_burst = number >= 40 && number < 50;
      if (in_burst || testing::uniform(0.0, 1.0) < 1.0 / 3.0) continue;
      Frame frame = tagged(number, cadence);
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

TEST(AmbientStage, HeldPicturesAreAllScannedOnceTheCadenceIsFound) {
  testing::reseed();
  Street street;
  street.cadence = Cadence::parse("dark,0");
  street.build();
  AmbientStage stage{AmbientOptions{}};
  std::vector<Pair> pairs;
  for (std::uint64_t sequence = 0; sequence < 5; ++sequence) {
    stage.push(street.picture(sequence));
    take(stage, pairs);
  }
  EXPECT_TRUE(pairs.empty());
  stage.push(street.picture(5));
  take(stage, pairs);
  stage.finish();
  take(stage, pairs);
  ASSERT_EQ(pairs.size(), 3U);
  EXPECT_EQ(pairs[0].lit, 1U);
  EXPECT_EQ(pairs[2].lit, 5U);
  EXPECT_THAT(stage.decisions(), HasSubstr("cadence dark,0 (found)"));
  EXPECT_THAT(stage.decisions(), HasSubstr("ambient alternate"));
}

TEST(AmbientStage, EmptySceneIsScannedAndTheCadenceFoundWhenThereIsSomethingToSee) {
  testing::reseed();
  Street street;
  street.build();
  AmbientStage stage{AmbientOptions{}};
  std::vector<Pair> pairs;
  for (std::uint64_t sequence = 0; sequence < 80; ++sequence) {
    street.amplitude_dn = sequence < 20 ? 0.0 : 40.0;
    stage.push(street.picture(sequence));
    take(stage, pairs);
    if (sequence == 19) {
      EXPECT_EQ(pairs.size(), 20U);
    }
  }
  EXPECT_THAT(stage.decisions(), HasSubstr("cadence 0,dark (found)"));
  EXPECT_EQ(pairs.back().lit, 78U);
}

TEST(AmbientStage, RestartOfTheSourceFindsTheCadenceAgain) {
  testing::reseed();
  Street street;
  street.build();
  AmbientStage stage{AmbientOptions{}};
  std::vector<Pair> pairs;
  for (std::uint64_t sequence = 0; sequence < 8; ++sequence) {
    stage.push(street.picture(sequence));
    take(stage, pairs);
  }
  const std::size_t before = pairs.size();
  EXPECT_EQ(before, 4U);
  street.cadence = Cadence::parse("dark,0");
  for (std::uint64_t sequence = 0; sequence < 8; ++sequence) {
    stage.push(street.picture(sequence));
    take(stage, pairs);
  }
  stage.finish();
  take(stage, pairs);
  ASSERT_EQ(pairs.size(), before + 4);
  for (std::size_t i = before; i < pairs.size(); ++i) EXPECT_EQ(pairs[i].lit % 2, 1U);
}

TEST(AmbientStage, WrongCadenceIsReported) {
  testing::reseed();
  Street street;
  street.build();
  AmbientStage stage(with_cadence("dark,0"));
  for (std::uint64_t sequence = 0; sequence < 8; ++sequence) {
    stage.push(street.picture(sequence));
    while (stage.next() != nullptr) {
    }
  }
  EXPECT_THAT(stage.decisions(), HasSubstr("'dark,0' was given, but the pictures show '0,dark'"));
}

TEST(AmbientStage, WrongFieldOrderIsReported) {
  testing::reseed();
  Street street;
  street.field = Field::kInterlacedTopFirst;
  street.speed_px = 4.0;
  street.edge_dn = 60.0;
  street.build();
  for (const bool is_wrong : {false, true}) {
    AmbientStage stage{AmbientOptions{}};
    for (std::uint64_t sequence = 0; sequence < 8; ++sequence) {
      Frame picture = street.picture(sequence);
      if (is_wrong) picture.field = Field::kInterlacedBottomFirst;
      stage.push(picture);
      while (stage.next() != nullptr) {
      }
    }
    const std::string complaint = "the fields seem to be in the wrong order";
    if (is_wrong) {
      EXPECT_THAT(stage.decisions(), HasSubstr(complaint));
    } else {
      EXPECT_THAT(stage.decisions(), Not(HasSubstr(complaint)));
    }
  }
}

// Pictures whose source does not count those that it loses.
struct SilentLoss {
  std::vector<std::uint64_t> scanned;  // True numbers.
  std::string decisions;
};

SilentLoss scan_with_loss(const char* cadence, std::uint64_t lost, std::uint64_t count) {
  testing::reseed();
  Street street;
  street.cadence = Cadence::parse(cadence);
  street.speed_px = 3.0;
  street.texture_dn = 8.0;
  street.build();
  AmbientStage stage{AmbientOptions{}};
  std::vector<std::uint64_t> true_number;
  SilentLoss result;
  const auto take_true = [&] {
    while (const LitFrame* const lit = stage.next()) {
      result.scanned.push_back(true_number[lit->sequence]);
    }
  };
  for (std::uint64_t number = 0; number < count; ++number) {
    if (number == lost) continue;
    Frame frame = street.picture(number);
    frame.sequence = true_number.size();
    true_number.push_back(number);
    stage.push(frame);
    take_true();
  }
  stage.finish();
  take_true();
  result.decisions = stage.decisions();
  return result;
}

TEST(AmbientStage, LossThatNobodyCountsIsNoticedBeforeAScanIsMadeOfIt) {
  constexpr std::uint64_t kCount = 30;
  for (const char* const cadence : {"0,dark", "0,dark,dark"}) {
    for (const std::uint64_t lost : {12U, 13U, 14U}) {
      SCOPED_TRACE(::testing::Message() << cadence << ", lost " << lost);
      const SilentLoss loss = scan_with_loss(cadence, lost, kCount);
      const Cadence pattern = Cadence::parse(cadence);
      std::size_t lit = 0;
      for (std::uint64_t n = 0; n < kCount; ++n) lit += pattern.at(n).is_lit() ? 1 : 0;
      for (const std::uint64_t number : loss.scanned) {
        EXPECT_TRUE(pattern.at(number).is_lit()) << number;
      }
      EXPECT_GE(loss.scanned.size() + 4, lit);
      EXPECT_THAT(loss.decisions, HasSubstr("the cadence slipped and was found again"));
    }
  }
}

// A laser that is switched from every other picture to always on while the stripe wanders: what
// was found is refuted, and the pictures show no exposure that is dark.
TEST(AmbientStage, RefutedCadenceGivesWayToALaserThatIsAlwaysOn) {
  constexpr std::uint64_t kSwitched = 12;
  constexpr std::uint64_t kCount = 30;
  testing::reseed();
  Street street;
  street.texture_dn = 4.0;
  street.build();
  std::uint64_t now = 0;
  street.row = [&now](int, int) { return 40.0 + 13.0 * static_cast<double>(now % 12); };
  AmbientStage stage{AmbientOptions{}};
  std::vector<std::uint64_t> scanned;
  for (now = 0; now < kCount; ++now) {
    street.cadence = Cadence::parse(now < kSwitched ? "0,dark" : "0");
    stage.push(street.picture(now));
    while (const LitFrame* const lit = stage.next()) scanned.push_back(lit->sequence);
  }
  stage.finish();
  while (const LitFrame* const lit = stage.next()) scanned.push_back(lit->sequence);
  EXPECT_THAT(stage.decisions(), HasSubstr("cadence 0 (no dark exposure seen)"));
  std::size_t after = 0;
  for (const std::uint64_t sequence : scanned) {
    if (sequence < kSwitched) {
      EXPECT_EQ(sequence % 2, 0U);
    }
    if (sequence > kSwitched) ++after;
  }
  EXPECT_GE(after, kCount - kSwitched - 4);
}

TEST(AmbientStage, NothingLostIsNoSlip) {
  const SilentLoss none = scan_with_loss("0,0,dark", 1000, 30);
  EXPECT_EQ(none.scanned.size(), 20U);
  EXPECT_THAT(none.decisions, Not(HasSubstr("slipped")));
  EXPECT_THAT(none.decisions, Not(HasSubstr("gave no scan")));
}

TEST(AmbientStage, FramesOwnIlluminationWins) {
  AmbientStage stage{AmbientOptions{}};
  std::vector<Pair> pairs;
  const Cadence cadence = Cadence::parse("dark,1");
  for (std::uint64_t sequence = 0; sequence < 9; ++sequence) {
    Frame frame = tagged(sequence, cadence);
    frame.illumination = cadence.at(sequence);
    stage.push(frame);
    take(stage, pairs);
  }
  EXPECT_EQ(pairs, (Pairs{{1, 1, 1}, {3, 1, 3}, {5, 1, 5}, {7, 1, 7}}));
}

// ---- A source that was given the cadence, is lost and opened again: where in the cadence it goes
// on is not known, and it says so.

struct Reopened {
  Pairs before;
  Pairs after;
  std::string decisions;
};

Reopened reopen(
    const char* cadence, const char* cadence_after, double amplitude_after_dn = 40.0,
    const std::function<void(Frame&)>& change = [](Frame&) {}) {
  testing::reseed();
  Street street;
  street.build();
  AmbientStage stage(with_cadence(cadence));
  Reopened result;
  const auto push_all = [&](std::uint64_t first, std::uint64_t count, const char* lit, Pairs& pairs,
                            bool is_told) {
    street.cadence = Cadence::parse(lit);
    for (std::uint64_t sequence = first; sequence < first + count; ++sequence) {
      Frame frame = street.picture(sequence);
      frame.illumination = is_told ? street.cadence.at(sequence) : Illumination::unknown();
      if (!is_told) change(frame);
      stage.push(frame);
      take(stage, pairs);
    }
  };
  push_all(0, 20, cadence, result.before, true);
  street.amplitude_dn = amplitude_after_dn;
  push_all(60, 24, cadence_after, result.after, false);
  // And a second time, in the first phase again.
  street.amplitude_dn = 40.0;
  push_all(120, 24, cadence, result.after, false);
  stage.finish();
  take(stage, result.after);
  result.decisions = stage.decisions();
  return result;
}

TEST(AmbientStage, PhaseIsFoundAgainWhereTheSourceDoesNotKnowIt) {
  for (const auto& [given, after] : {std::pair{"0,dark", "dark,0"}, std::pair{"0,dark", "0,dark"},
                                     std::pair{"0,0,dark", "dark,0,0"}}) {
    SCOPED_TRACE(::testing::Message() << given << ", then " << after);
    const Reopened reopened = reopen(given, after);
    const std::size_t lit_part = given == std::string("0,dark") ? 2 : 3;
    EXPECT_GE(reopened.after.size(), 48 * (lit_part - 1) / lit_part - 3);
    for (const Pair& pair : reopened.after) {
      const bool is_after = pair.lit >= 60 && pair.lit < 120;
      const Cadence truth = Cadence::parse(is_after ? after : given);
      EXPECT_TRUE(truth.at(pair.lit).is_lit()) << pair.lit;
    }
    EXPECT_THAT(reopened.decisions, HasSubstr("its phase found in the pictures"));
    EXPECT_THAT(reopened.decisions, Not(HasSubstr("no longer knows")));
  }
}

// A source that never knew what lights its frames says only that it began anew.
TEST(AmbientStage, PhaseOfAnotherEpochIsFoundAgain) {
  for (const char* const given : {"0,dark", "auto"}) {
    testing::reseed();
    Street street;
    street.build();
    AmbientStage stage(with_cadence(given));
    Pairs pairs;
    for (std::uint64_t sequence = 0; sequence < 40; ++sequence) {
      if (sequence == 20) street.cadence = Cadence::parse("dark,0");
      Frame frame = street.picture(sequence);
      frame.epoch = sequence < 20 ? 0 : 1;
      stage.push(frame);
      take(stage, pairs);
    }
    stage.finish();
    take(stage, pairs);
    EXPECT_GE(pairs.size(), 18U) << given;
    for (const Pair& pair : pairs) EXPECT_EQ(pair.lit % 2, pair.lit < 20 ? 0U : 1U) << given;
  }
}

TEST(AmbientStage, NothingIsScannedWhereThePhaseCannotBeFound) {
  const Reopened reopened = reopen("0,dark", "dark,0", 0.0);
  EXPECT_EQ(reopened.before.size(), 10U);
  for (const Pair& pair : reopened.after) {
    EXPECT_GE(pair.lit, 120U);
    EXPECT_EQ(pair.lit % 2, 0U);
  }
  EXPECT_GE(reopened.after.size(), 9U);
  EXPECT_THAT(reopened.decisions, HasSubstr("the source no longer knows which exposures"));
}

TEST(AmbientStage, SourceThatKnowsThePhaseAgainIsBelieved) {
  const Reopened reopened = reopen("0,dark", "dark,0", 40.0, [](Frame& frame) {
    const bool is_second = frame.sequence >= 120;
    if (is_second) frame.illumination = Cadence::parse("0,dark").at(frame.sequence);
  });
  EXPECT_THAT(reopened.decisions, HasSubstr("cadence 0,dark (given)"));
  for (const Pair& pair : reopened.after) EXPECT_EQ(pair.lit % 2, pair.lit < 120 ? 1U : 0U);
}

TEST(AmbientStage, MethodThatNeedsDarkExposuresRefusesACadenceWithoutAny) {
  AmbientOptions options = with_cadence("0");
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
  AmbientStage stage(with_cadence("0,dark"));
  std::vector<std::uint8_t> memory(32 * 48);
  std::vector<Pair> pairs;
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

// ---- Cost.

TEST(AmbientStage, AllocatesNothingOnceWarm) {
  testing::reseed();
  for (const Field order : {Field::kProgressive, Field::kInterlacedTopFirst}) {
    Street street;
    street.field = order;
    street.speed_px = 5.0;
    street.lamps = {{250.0, 60.0, 5.0}};
    street.build();
    std::vector<Frame> pictures;
    for (std::uint64_t sequence = 0; sequence < 30; ++sequence) {
      const Frame picture = street.picture(sequence);
      if (picture.is_interlaced()) {
        for (const Frame& field : split_fields(picture)) pictures.push_back(field);
      } else {
        pictures.push_back(picture);
      }
    }
    // The source knows: nothing is to be looked for in the pictures.
    for (Frame& picture : pictures) {
      picture.illumination = street.cadence.at(picture.exposure_number());
    }
    AmbientStage stage(with_cadence("0,dark"));
    std::uint64_t allocations = 0;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      const testing::AllocationCounter counter;
      stage.push(pictures[i]);
      while (stage.next() != nullptr) {
      }
      if (i >= 20) allocations += counter.count();
    }
    EXPECT_EQ(allocations, 0U);
  }
}

// An empty street: pictures neither confirm nor refute what was given, and are asked again.
TEST(AmbientStage, AsksThePicturesAgainWithoutAllocating) {
  for (const Field order : {Field::kProgressive, Field::kInterlacedTopFirst}) {
    testing::reseed();
    Street street;
    street.field = order;
    street.size = {160, 120};
    street.amplitude_dn = 0.0;
    street.speed_px = 5.0;
    street.build();
    AmbientStage stage(with_cadence("0"));
    std::uint64_t allocations = 0;
    for (std::uint64_t sequence = 0; sequence < 100; ++sequence) {
      const Frame picture = street.picture(sequence);
      const testing::AllocationCounter counter;
      stage.push(picture);
      while (stage.next() != nullptr) {
      }
      if (sequence >= 30) allocations += counter.count();
    }
    EXPECT_EQ(allocations, 0U);
  }
}

}  // namespace
}  // namespace striper
