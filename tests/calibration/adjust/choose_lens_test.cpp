// SPDX-License-Identifier: Apache-2.0
// Proves that the lens is chosen by what predicts unseen corners, not by what fits best: the
// simplest one that is right wins over richer ones with a smaller residual, and a lens that the
// simple one cannot describe is told apart.
#include <gtest/gtest.h>

#include <striper/adjust/choose_lens.hpp>

#include "support/striper_session.hpp"

namespace striper {
namespace {

using testing::SyntheticStriper;

TEST(ChooseLens, TakesTheSimplestThatPredictsAsWell) {
  const CameraModel truth(640, 480, 615.0, 615.0, 319.5, 239.5, LensModel::kPlumbBob,
                          {-0.2, 0.05, 0.0, 0.0, 0.0});
  const LensChoice choice = choose_lens(testing::lens_boards(truth, 12), std::nullopt);
  EXPECT_EQ(LensModel::kPlumbBob, choice.lens);
  EXPECT_TRUE(choice.hold_k3);
  ASSERT_EQ(4U, choice.trials.size());
  EXPECT_EQ("plumb_bob without k3", choice.trials[0].name());
  EXPECT_LE(choice.trials[1].rms_px, choice.trials[0].rms_px + 1e-6)
      << "one more coefficient fits better, and is not taken for it";
}

TEST(ChooseLens, LeavesTheSimplestWhereItDoesNotPredict) {
  const CameraModel truth(640, 480, 260.0, 260.0, 319.5, 239.5, LensModel::kEquidistant,
                          {0.03, -0.01, 0.0, 0.0});
  const LensChoice choice = choose_lens(testing::lens_boards(truth, 12), std::nullopt);
  EXPECT_FALSE(choice.lens == LensModel::kPlumbBob && choice.hold_k3);
  for (const LensTrial& trial : choice.trials)
    if (trial.lens == choice.lens && trial.hold_k3 == choice.hold_k3) {
      EXPECT_LT(trial.held_out_px, 0.98 * choice.trials.front().held_out_px);
    }
}

TEST(ChooseLens, TriesOnlyWhatIsWanted) {
  const Observations observations = testing::lens_boards(SyntheticStriper().camera, 12);
  const LensChoice choice = choose_lens(observations, LensModel::kRationalPolynomial);
  EXPECT_EQ(LensModel::kRationalPolynomial, choice.lens);
  EXPECT_EQ(1U, choice.trials.size());
}

TEST(ChooseLens, TakesTheSimplestWhereThereIsNothingToHoldOut) {
  Observations observations = testing::lens_boards(SyntheticStriper().camera, 12);
  observations.views.resize(5);
  const LensChoice choice = choose_lens(observations, std::nullopt);
  EXPECT_EQ(LensModel::kPlumbBob, choice.lens);
  EXPECT_TRUE(choice.hold_k3);
}

}  // namespace
}  // namespace striper
