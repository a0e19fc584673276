// SPDX-License-Identifier: Apache-2.0
// Proves that what the image shows about doubted returns tells more of them than all that was known
// before: in most rooms of those that nothing was learnt of (seeds from 10000) their log loss is
// less, and so it is in all together; and more of them are sure and right. Does not prove how
// reliable confidences are then: bench/stripe_choice_table says that.
#include <cmath>
#include <cstdint>
#include <iostream>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "stripe/report/patches/rated_patches.hpp"
#include "support/extracted_trial.hpp"
#include "support/instrumented.hpp"
#include "support/stripe_score.hpp"

namespace striper {
namespace {

constexpr std::uint64_t kHeldOut = 10000;
constexpr int kRooms = 40;  // Of 24, two with many textures decide.
const double kSureOdds = std::log(99.0);
constexpr double kChanged = 1e-4;  // More than rounding.

struct Rated {
  double loss = 0.0;
  int sure_and_right = 0;
  int sure_and_wrong = 0;

  void add(double odds, bool is_right) {
    loss += std::log1p(std::exp(is_right ? -odds : odds));
    if (odds < kSureOdds) return;
    (is_right ? sure_and_right : sure_and_wrong) += 1;
  }
  void add(const Rated& other) {
    loss += other.loss;
    sure_and_right += other.sure_and_right;
    sure_and_wrong += other.sure_and_wrong;
  }
};

struct Sums {
  Rated before, after;
  int doubted = 0;
  int columns = 0;
  bool is_changed = false;

  void add(const Sums& room) {
    before.add(room.before);
    after.add(room.after);
    doubted += room.doubted;
    columns += room.columns;
  }
};

double log_odds(double p) { return std::log(p / (1.0 - p)); }

void add_frame(const testing::Extracted& extracted, Sums& sums) {
  const auto& [extractor, frame, stripe, truth] = extracted;
  const std::vector<float>& before = extractor.confidence().among_others();
  for (std::size_t line = 0; line < stripe.size(); ++line) {
    ++sums.columns;
    if (!detail::RatedPatches::is_doubted(before[line])) continue;
    if (extractor.is_bridged(static_cast<int>(line))) continue;  // It is elsewhere now.
    const std::optional<float> after = extractor.confidence().of_line(line);
    ASSERT_TRUE(after.has_value());
    const auto judged =
        testing::judge_position(truth, static_cast<int>(line), stripe.across_px[line],
                                static_cast<double>(stripe.sigma_px[line]))
            .judgement;
    if (judged == testing::Judgement::kMixed) continue;
    const bool is_right = judged == testing::Judgement::kRight;
    sums.before.add(static_cast<double>(before[line]), is_right);
    sums.after.add(log_odds(static_cast<double>(*after)), is_right);
    ++sums.doubted;
    sums.is_changed |= std::abs(log_odds(static_cast<double>(*after)) -
                                static_cast<double>(before[line])) > kChanged;
  }
}

TEST(PatchRating, TellsMoreThanWhatWasKnownBefore) {
  STRIPER_SKIP_FIGURES_WHERE_INSTRUMENTED();
  Sums sums;
  int changed = 0;
  int better = 0;
  for (std::uint64_t i = 0; i < kRooms; ++i) {
    Sums room;
    testing::extract_trial({.kind = "rooms", .seed = kHeldOut + i, .frames = 1}, {},
                           [&](const testing::Extracted& frame) { add_frame(frame, room); });
    changed += room.is_changed ? 1 : 0;
    better += room.is_changed && room.after.loss < room.before.loss ? 1 : 0;
    sums.add(room);
  }
  std::cout << fmt::format(
      "{} columns, {} doubted returns: log loss {:.3f}, then {:.3f}; sure and right {}, then {}; "
      "sure and wrong {}, then {}\n",
      sums.columns, sums.doubted, sums.before.loss / sums.doubted, sums.after.loss / sums.doubted,
      sums.before.sure_and_right, sums.after.sure_and_right, sums.before.sure_and_wrong,
      sums.after.sure_and_wrong);
  ASSERT_GT(sums.doubted, 1000);
  // Were it as often worse as better, so many of 20 were better with a probability of .02.
  EXPECT_GE(changed, 20);
  EXPECT_GE(4 * better, 3 * changed) << better << " rooms of " << changed;
  EXPECT_LT(sums.after.loss, sums.before.loss);
  EXPECT_GT(sums.after.sure_and_right, sums.before.sure_and_right);
  EXPECT_LT(sums.after.sure_and_wrong, 0.002 * sums.columns);
}

}  // namespace
}  // namespace striper
