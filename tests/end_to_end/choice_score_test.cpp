// SPDX-License-Identifier: Apache-2.0
// Proves that what judges the choice of the stripe judges rightly: returns against a truth made by
// hand, the sums and bins, and that random scenes are a function of their seed and show what they
// are for, shaded ones no laser where their truth has none. Does not judge the choice itself.
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <striper/simulator/simulator.hpp>

#include "support/choice_trial.hpp"
#include "support/colour_camera.hpp"
#include "support/random_scene.hpp"
#include "support/real_stripe.hpp"
#include "support/stripe_score.hpp"

namespace striper {
namespace {

using testing::JudgedReturn;
using testing::Judgement;
using testing::StripeScore;

constexpr NoiseModel kNoise{2.0, 0.0, 0.0, 8};

TrueLine line_with(double v_px, bool near_edge = false) {
  TrueLine line;
  line.status = TruthStatus::kVisible;
  line.brightest.v_px = v_px;
  line.brightest.amplitude_dn = 40.0;
  line.brightest.width_px = 1.2;
  line.brightest.near_edge = near_edge;
  return line;
}

Return return_at(double v_px, ReturnStatus status = ReturnStatus::kOk, float confidence = 0.97F) {
  Return r;
  r.v_px = v_px;
  r.row_sigma_px = 0.1F;
  r.confidence = confidence;
  r.status = status;
  return r;
}

// Twelve columns: a stripe at row 30, from column 6 at row 60, and nothing in the last two.
struct Example {
  Truth truth;
  PolarScan scan;
  cv::Mat expected_dn = cv::Mat(100, 12, CV_32FC1, cv::Scalar(50.0));

  Example() {
    for (int i = 0; i < 12; ++i) {
      const double v_px = i < 6 ? 30.0 : 60.0;
      truth.lines.push_back(i < 10 ? line_with(v_px, i == 5 || i == 6) : TrueLine{});
      if (i < 10) truth.lines.back().brightest.u_px = i;
      scan.returns.push_back(return_at(v_px));
    }
  }

  std::vector<JudgedReturn> judged() const {
    return testing::judge(scan, truth, expected_dn, kNoise);
  }
};

TEST(JudgedReturns, AreRightWithinHalfAPixelOrThreeSigmas) {
  Example example;
  example.scan.returns[0].v_px = 30.49;
  example.scan.returns[1].v_px = 30.51;
  example.scan.returns[2].v_px = 28.6;
  example.scan.returns[2].row_sigma_px = 0.5F;
  const auto judged = example.judged();
  EXPECT_EQ(judged[0].judgement, Judgement::kRight);
  EXPECT_EQ(judged[1].judgement, Judgement::kWrong);
  EXPECT_NEAR(judged[1].error_px, 0.51, 1e-9);
  EXPECT_EQ(judged[2].judgement, Judgement::kRight);
}

TEST(JudgedReturns, AreMixedOnlyAtAnEdgeAndBetweenItsStripes) {
  Example example;
  example.scan.returns[5].v_px = 33.0;  // Near the edge, towards the other stripe:
  example.scan.returns[6].v_px = 57.0;  // the same from the other side,
  const auto mixed = example.judged();
  EXPECT_EQ(mixed[5].judgement, Judgement::kMixed);
  EXPECT_EQ(mixed[6].judgement, Judgement::kMixed);
  example.scan.returns[5].v_px = 45.0;  // half way, where no light is,
  example.scan.returns[6].v_px = 62.0;  // and beyond both.
  example.scan.returns[0].v_px = 33.0;  // Not near an edge.
  const auto wrong = example.judged();
  EXPECT_EQ(wrong[5].judgement, Judgement::kWrong);
  EXPECT_EQ(wrong[6].judgement, Judgement::kWrong);
  EXPECT_EQ(wrong[0].judgement, Judgement::kWrong);
}

TEST(JudgedReturns, ArePhantomsWhereThereIsNoStripeAndMixedInWhatItSpillsOver) {
  Example example;
  example.scan.returns[10].v_px = 20.0;
  const auto judged = example.judged();
  EXPECT_EQ(judged[10].judgement, Judgement::kPhantom);
  EXPECT_EQ(judged[11].judgement, Judgement::kMixed);  // At the row of the stripe beside it.
}

TEST(JudgedReturns, MayBeAnyOfTheTrueReturnsOfTheirLine) {
  Example example;
  TrueReturn other = example.truth.lines[0].brightest;
  other.v_px = 80.0;
  example.truth.lines[0].others.push_back(other);
  example.scan.returns[0].v_px = 80.2;
  EXPECT_EQ(example.judged()[0].judgement, Judgement::kRight);
}

TEST(JudgedReturns, HaveTheSnrOfWhatDoesNotClip) {
  Example example;
  const double noise_dn = std::sqrt(4.0 + 1.0 / 12.0);
  EXPECT_NEAR(example.judged()[0].truth_snr, 40.0 / noise_dn, 1e-4);
  example.expected_dn.setTo(285.0);  // 30 of the 40 are above full scale.
  EXPECT_NEAR(example.judged()[0].truth_snr, 10.0 / noise_dn, 1e-4);
}

TEST(JudgedReturns, StandOutFromNoiseAndTextureTogetherButNotFromARamp) {
  Example example;
  cv::Mat background(100, 12, CV_32FC1);
  for (int v = 0; v < 100; ++v) background.row(v).setTo(0.5 * v);
  const auto distinctness = [&] {
    return testing::judge(example.scan, example.truth, example.expected_dn, kNoise, background)[0]
        .truth_distinctness;
  };
  EXPECT_NEAR(distinctness(), example.judged()[0].truth_snr, 1e-4);
  // Rows of +8 and -8 DN, half a period of which is what a row is compared with: rises of 16 DN.
  for (int v = 0; v < 100; ++v) background.row(v).setTo(v % 6 < 3 ? 8.0 : -8.0);
  EXPECT_NEAR(distinctness(), 40.0 / std::sqrt(4.0 + 1.0 / 12.0 + 16.0 * 16.0), 1e-4);
}

TEST(JudgedReturns, AreNeitherOnLightWhoseMiddleIsShaded) {
  Example example;
  cv::Mat background(100, 12, CV_32FC1, cv::Scalar(50.0));
  const auto judgement = [&](std::size_t line) {
    return testing::judge(example.scan, example.truth, example.expected_dn, kNoise, background)
        .at(line)
        .judgement;
  };
  const auto light = [&](int line, int row, float dn) {
    for (const int k : {-1, 0, 1})
      example.expected_dn.at<float>(row + k, line) = 50.0F + dn * (k == 0 ? 1.0F : 0.6F);
  };
  example.scan.returns[2].v_px = 80.3;
  example.scan.returns[10].v_px = 20.2;
  EXPECT_EQ(judgement(2), Judgement::kWrong);
  EXPECT_EQ(judgement(10), Judgement::kPhantom);
  light(2, 80, 18.0F);  // The noise is 2 DN.
  light(10, 20, 18.0F);
  EXPECT_EQ(judgement(2), Judgement::kSide);
  EXPECT_EQ(judgement(10), Judgement::kSide);
  StripeScore score;
  score.add(example.scan,
            testing::judge(example.scan, example.truth, example.expected_dn, kNoise, background));
  EXPECT_EQ(score.side, 2U);
  EXPECT_EQ(score.wrong + score.found, 9U);  // Line 2 is not found; line 11 is mixed.
  example.scan.returns[2].v_px = 80.6;       // Beside it,
  light(10, 20, 15.0F);                      // too faint,
  EXPECT_EQ(judgement(2), Judgement::kWrong);
  EXPECT_EQ(judgement(10), Judgement::kPhantom);
  light(2, 34, 18.0F);  // a true return's own, at row 30, drawn aside,
  example.scan.returns[2].v_px = 34.0;
  EXPECT_EQ(judgement(2), Judgement::kWrong);
  light(10, 20, 18.0F);  // and a thing that is as bright without the laser.
  example.expected_dn.copyTo(background);
  EXPECT_EQ(judgement(10), Judgement::kPhantom);
}

TEST(StripeScores, CountAndBinWhatWasJudged) {
  Example example;
  example.scan.returns[0].v_px = 31.0;                                      // Biased,
  example.scan.returns[1].v_px = 90.0;                                      // another thing,
  example.scan.returns[2] = return_at(30.0, ReturnStatus::kOutlier, 0.6F);  // doubted,
  example.scan.returns[3] = Return{};                                       // missed,
  example.scan.returns[10].v_px = 20.0;                                     // and a phantom.
  StripeScore score;
  score.add(example.scan, example.judged());
  EXPECT_EQ(score.columns, 12U);
  EXPECT_EQ(score.visible, 10U);
  EXPECT_EQ(score.clear, 10U);
  EXPECT_EQ(score.found, 6U);
  EXPECT_EQ(score.wrong, 3U);
  EXPECT_EQ(score.biased, 1U);
  EXPECT_EQ(score.phantom, 1U);
  EXPECT_EQ(score.mixed, 1U);
  EXPECT_EQ(score.bins[1].count, 1U);  // From 0.5: the doubted one, which is the stripe.
  EXPECT_EQ(score.bins[1].stripe, 1U);
  EXPECT_EQ(score.bins[4].count, 9U);  // From 0.95; the mixed one is not counted.
  EXPECT_EQ(score.bins[4].stripe, 6U);
  EXPECT_NEAR(score.brier(), (0.4 * 0.4 + 6 * 0.03 * 0.03 + 3 * 0.97 * 0.97) / 10.0, 1e-6);
  StripeScore twice = score;
  twice.add(score);
  EXPECT_EQ(twice.found, 12U);
  EXPECT_NEAR(twice.brier(), score.brier(), 1e-12);
}

TEST(RandomScenes, AreAFunctionOfTheirSeed) {
  const cv::Mat image = Simulator(testing::random_room(7)).render(0).image;
  const cv::Mat again = Simulator(testing::random_room(7)).render(0).image;
  EXPECT_EQ(cv::norm(image, again, cv::NORM_INF), 0.0);
  EXPECT_NE(testing::random_room(7).objects.size() * 1e3 + testing::random_room(7).camera.fx(),
            testing::random_room(8).objects.size() * 1e3 + testing::random_room(8).camera.fx());
}

TEST(RandomScenes, MostlyShowTheStripeAndAreDarkWhenTheLaserIsOff) {
  std::size_t visible = 0;
  std::size_t columns = 0;
  for (const std::uint64_t seed : {1, 3}) {
    const Scene scene = testing::random_room(seed);
    Simulator lit(scene);
    const Truth truth = lit.truth(0).at(0);
    Simulator dark(testing::without_laser(scene));
    const cv::Mat difference = lit.expected_dn(0) - dark.expected_dn(0);
    for (const TrueLine& line : truth.lines) {
      ++columns;
      if (line.status != TruthStatus::kVisible) continue;
      ++visible;
      if (line.brightest.near_edge || line.brightest.amplitude_dn < 2.0) continue;
      // The light is where the truth says, and nowhere else in the dark scene.
      const int u = static_cast<int>(std::lround(line.brightest.u_px));
      const int v = static_cast<int>(std::lround(line.brightest.v_px));
      EXPECT_GT(difference.at<float>(v, u), 0.4 * line.brightest.amplitude_dn) << scene.name << u;
    }
  }
  EXPECT_GT(static_cast<double>(visible), 0.6 * static_cast<double>(columns));
}

TEST(RandomScenes, HaveTheAmplitudeThatTheClosedFormSays) {
  Scene scene = Scene::flat_wall(2.0);
  scene.imager.blur_sigma_px = 0.8;
  const double wall = scene.objects.front().material.reflectance;
  const TrueReturn truth = Simulator(scene).truth(0).at(0).lines[320].brightest;
  const double range_m = std::hypot(2.0, 0.0);
  EXPECT_NEAR(testing::stripe_amplitude_dn(scene, wall, range_m) / truth.amplitude_dn, 1.0, 0.02);
  EXPECT_NEAR(testing::look_of(scene).width_px.value() / truth.width_px, 1.0, 0.1);
}

TEST(ChoiceTrials, HaveNoLaserWhereTheyAreShaded) {
  testing::TrialCamera whole({.kind = "sessions", .seed = 1});
  testing::TrialCamera off({.kind = "off sessions", .seed = 1});
  testing::TrialCamera shaded({.kind = "sessions", .seed = 1, .is_shaded = true});
  const cv::Mat lit_dn = whole.expected_dn(0);
  const cv::Mat unlit_dn = off.expected_dn(0);
  const cv::Mat image_dn = shaded.expected_dn(0);
  const Truth truth = shaded.truth(0);
  const Truth whole_truth = whole.truth(0);
  int changed = 0;
  for (int u = 0; u < image_dn.cols; ++u) {
    const auto i = static_cast<std::size_t>(u);
    const bool is_unlit = cv::norm(image_dn.col(u), unlit_dn.col(u), cv::NORM_INF) == 0.0;
    const bool is_lit = cv::norm(image_dn.col(u), lit_dn.col(u), cv::NORM_INF) == 0.0;
    EXPECT_TRUE(is_lit || is_unlit) << u;
    EXPECT_TRUE(is_lit || truth.lines[i].status != TruthStatus::kVisible) << u;
    if (truth.lines[i].status == whole_truth.lines[i].status) continue;
    EXPECT_TRUE(is_unlit) << u;
    ++changed;
  }
  EXPECT_GE(changed, 3);
}

TEST(ColourCameras, PutTheLaserIntoItsOwnChannelAndALittleIntoTheOthers) {
  const Scene scene = testing::random_session(1);
  for (const auto laser :
       {testing::ColourCamera::Laser::kRed, testing::ColourCamera::Laser::kGreen}) {
    // The noise is a function of the pixel and its light, so most of it falls out.
    const cv::Mat lit = testing::ColourCamera(scene, laser).render(0).image;
    const cv::Mat dark =
        testing::ColourCamera(testing::without_laser(scene), laser).render(0).image;
    ASSERT_EQ(lit.type(), scene.imager.bit_depth > 8 ? CV_16UC3 : CV_8UC3);
    cv::Mat difference;
    cv::subtract(lit, dark, difference, cv::noArray(), CV_32F);
    const cv::Scalar light = cv::sum(difference);
    const int own = laser == testing::ColourCamera::Laser::kRed ? 2 : 1;
    for (int i = 0; i < 3; ++i) {
      EXPECT_LT(i == own ? 0.0 : light[i], 0.3 * light[own]) << own << i;
      EXPECT_GT(light[i], 0.0) << own << i;
    }
  }
}

TEST(RealImages, HaveTheirStripeJudgedBetweenTheKnots) {
  testing::RealImage image;
  image.stripes = {{{0.0, 10.0}, {10.0, 20.0}}};
  image.empty = {{12, 13}};
  PolarScan scan;
  for (int i = 0; i < 16; ++i) scan.returns.push_back(return_at(10.0 + i));
  scan.returns[5].v_px = 30.0;
  scan.returns[6] = Return{};
  testing::RealScore score;
  score.add(scan, image);
  EXPECT_EQ(score.with_stripe, 11U);
  EXPECT_EQ(score.empty, 2U);
  EXPECT_EQ(score.found, 9U);
  EXPECT_EQ(score.wrong, 3U);
  EXPECT_EQ(score.unjudged, 3U);
}

TEST(RealImages, AreAllReadFromTheTable) {
  const auto images = testing::real_images();
  EXPECT_EQ(images.size(), 159U);
  for (const auto& image : images) EXPECT_FALSE(image.stripes.empty()) << image.file;
}

}  // namespace
}  // namespace striper
