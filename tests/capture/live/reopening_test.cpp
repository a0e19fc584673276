// SPDX-License-Identifier: Apache-2.0
// Proves what a live source does about a device that is lost: pauses that grow, one message for
// each reason, an end where it is to have one, and that another stream is refused. Not that a
// device is noticed to be lost: that is in the tests of each source.
#include "live/reopening.hpp"

#include <limits>
#include <stdexcept>
#include <vector>

#include <gmock/gmock.h>

#include <striper/core/error.hpp>

#include "support/error_of.hpp"
#include "support/heard.hpp"

namespace striper::detail {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::StartsWith;
using Outcome = Reopening::Outcome;

constexpr double kForever_s = std::numeric_limits<double>::infinity();

const StreamKind kKind{{64, 48}, {64, 48}, 8, 1, "a", "Mono8 64x48"};

class ReopeningTest : public ::testing::Test {
 protected:
  Reopening make(double give_up_s) const {
    return {heard_.port(), "camera A", kKind, {20ms, 100ms}, give_up_s};
  }

  std::vector<std::string> messages() const {
    std::vector<std::string> all;
    for (const Event& event : heard_.events()) all.push_back(event.message);
    return all;
  }

  striper::testing::Heard heard_;
};

void refuse(const char* why) { throw std::runtime_error(why); }

TEST_F(ReopeningTest, PausesGrowToTheLongestAndBeginAnewWithEachLoss) {
  Reopening reopening = make(kForever_s);
  for (int loss = 0; loss < 2; ++loss) {
    reopening.lose("gone");
    std::vector<std::chrono::milliseconds> pauses{reopening.pause()};
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(reopening.attempt([] { refuse("not there"); }), Outcome::kNotYet);
      pauses.push_back(reopening.pause());
    }
    EXPECT_THAT(pauses, ElementsAre(0ms, 20ms, 40ms, 80ms, 100ms));
  }
}

TEST_F(ReopeningTest, SaysEachReasonOnce) {
  Reopening reopening = make(kForever_s);
  EXPECT_TRUE(reopening.lose("it does not answer"));
  for (const char* why : {"no such device", "no such device", "busy"}) {
    reopening.attempt([why] { refuse(why); });
  }
  EXPECT_EQ(reopening.attempt([] {}), Outcome::kBack);
  EXPECT_THAT(messages(),
              ElementsAre("camera A is lost: it does not answer; trying to open it again",
                          "camera A is lost and not open yet: no such device",
                          "camera A is lost and not open yet: busy",
                          StartsWith("camera A is back after 0.")));
}

TEST_F(ReopeningTest, EndsAtOnceWhereItIsNotToBeOpenedAgain) {
  EXPECT_FALSE(make(0.0).lose("it does not answer"));
  ASSERT_EQ(heard_.events().size(), 1U);
  EXPECT_EQ(heard_.events()[0].code, EventCode("source_gone"));
  EXPECT_THAT(messages(), ElementsAre("camera A is lost: it does not answer; the stream ends"));
}

TEST_F(ReopeningTest, EndsWhereItIsGoneForTooLong) {
  Reopening reopening = make(1e-9);
  EXPECT_TRUE(reopening.lose("it does not answer"));
  EXPECT_EQ(reopening.attempt([] { refuse("no such device"); }), Outcome::kGone);
  EXPECT_EQ(heard_.events().back().code, EventCode("source_gone"));
  EXPECT_EQ(messages().back(),
            "camera A did not come back in 1e-09 s: no such device; the stream ends");
}

TEST_F(ReopeningTest, AnotherStreamIsRefused) {
  const Reopening reopening = make(kForever_s);
  StreamKind now = kKind;
  now.words = "other words for the same";
  EXPECT_NO_THROW(reopening.require_same(now));
  for (StreamKind other : {StreamKind{{32, 48}, {64, 48}, 8, 1, "a", "X"},
                           StreamKind{{64, 48}, {32, 48}, 8, 1, "a", "X"},
                           StreamKind{{64, 48}, {64, 48}, 10, 1, "a", "X"},
                           StreamKind{{64, 48}, {64, 48}, 8, 3, "a", "X"},
                           StreamKind{{64, 48}, {64, 48}, 8, 1, "b", "X"}}) {
    const Error error = striper::testing::error_of([&] { reopening.require_same(other); });
    EXPECT_EQ(error.kind(), ErrorKind::kDevice);
    EXPECT_STREQ(error.what(), "camera A came back with X and was Mono8 64x48");
  }
}

}  // namespace
}  // namespace striper::detail
