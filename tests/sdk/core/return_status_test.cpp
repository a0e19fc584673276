// SPDX-License-Identifier: Apache-2.0
// Proves that every status has a word of its own that reads back, and that the verdicts are as
// documented.
#include <set>

#include <gtest/gtest.h>

#include <striper/core/return_status.hpp>

namespace striper {
namespace {

TEST(ReturnStatus, EveryStatusHasItsOwnWordThatReadsBack) {
  std::set<std::string_view> words;
  for (int i = 0; i < kReturnStatusCount; ++i) {
    const auto status = static_cast<ReturnStatus>(i);
    words.insert(to_string(status));
    EXPECT_EQ(return_status_from_string(to_string(status)), status);
  }
  EXPECT_EQ(words.size(), static_cast<std::size_t>(kReturnStatusCount));
  EXPECT_EQ(return_status_from_string("fine"), std::nullopt);
}

TEST(ReturnStatus, VerdictSeparatesGoodDoubtfulAndMissing) {
  EXPECT_EQ(verdict(ReturnStatus::kOk), Verdict::kGood);
  EXPECT_EQ(verdict(ReturnStatus::kSaturated), Verdict::kDoubtful);
  EXPECT_EQ(verdict(ReturnStatus::kOutOfRange), Verdict::kDoubtful);
  EXPECT_EQ(verdict(ReturnStatus::kFilled), Verdict::kDoubtful);
  EXPECT_EQ(verdict(ReturnStatus::kOutlier), Verdict::kDoubtful);
  EXPECT_EQ(verdict(ReturnStatus::kNoStripe), Verdict::kMissing);
  EXPECT_EQ(verdict(ReturnStatus::kBlind), Verdict::kMissing);
}

// They stand in recordings and messages.
TEST(ReturnStatus, NumbersStayWhatTheyWere) {
  const char* const words[] = {"ok",     "saturated",     "ambiguous",    "wide",      "narrow",
                               "weak",   "edge",          "out_of_range", "no_stripe", "blind",
                               "behind", "outside_model", "filled",       "outlier"};
  for (int i = 0; i < kReturnStatusCount; ++i)
    EXPECT_EQ(to_string(static_cast<ReturnStatus>(i)), words[i]);
}

}  // namespace
}  // namespace striper
