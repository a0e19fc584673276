// SPDX-License-Identifier: Apache-2.0
// Proves that a stripe becomes the scan that the exact triangulation gives, error bars and reasons
// included, for every lens, axis and field, and that it allocates nothing after the first frame.
#include <cmath>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/scan/scan_projector.hpp>

#include "support/allocation_counter.hpp"
#include "support/models.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

Stripe random_stripe(const StriperModel& model, const PixelGrid& grid = {}) {
  Stripe stripe;
  stripe.axis = model.axis;
  stripe.grid = grid;
  const bool columns = model.axis == StripeAxis::kColumns;
  const AxisGrid& along = columns ? grid.u : grid.v;
  const int extent = columns ? model.camera.width() : model.camera.height();
  stripe.reset(static_cast<int>((extent - along.offset) / along.step));
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    stripe.across_px[i] = testing::uniform(0.0, columns ? 479.0 : 639.0);
    stripe.sigma_px[i] = 0.1F;
    stripe.amplitude_dn[i] = 50.0F;
    stripe.width_px[i] = 0.8F;
    stripe.confidence[i] = 1.0F;
    stripe.status[i] = ReturnStatus::kOk;
  }
  return stripe;
}

double exact_range(const Triangulator& exact, const Stripe& stripe, std::size_t i, double shift) {
  const Eigen::Vector2d pixel = stripe.axis == StripeAxis::kColumns
                                    ? Eigen::Vector2d(stripe.u_px(i), stripe.v_px(i) + shift)
                                    : Eigen::Vector2d(stripe.u_px(i) + shift, stripe.v_px(i));
  const PlanePoint point = exact.triangulate(pixel);
  return point.status == ReturnStatus::kBehind ? std::numeric_limits<double>::infinity()
                                               : point.range_m();
}

void expect_scan_is_exact(const StriperModel& model, const PixelGrid& grid = {}) {
  const Triangulator exact(model, 0);
  ScanProjector projector(model, {});
  const Stripe stripe = random_stripe(model, grid);
  PolarScan scan;
  projector.project(stripe, 0, scan);
  ASSERT_EQ(scan.returns.size(), stripe.size());
  int good = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const Return& r = scan.returns[i];
    const PlanePoint truth = exact.triangulate({stripe.u_px(i), stripe.v_px(i)});
    if (truth.status != ReturnStatus::kOk) {
      EXPECT_EQ(r.status, truth.status);
      EXPECT_TRUE(std::isnan(r.range_m));
      continue;
    }
    // The tables are right to 1e-7 px; what that is in range grows with the square of the range.
    const double tolerance =
        3e-7 * std::abs(exact_range(exact, stripe, i, 0.5) - exact_range(exact, stripe, i, -0.5));
    if (!(tolerance < 1e-3)) continue;
    ++good;
    EXPECT_EQ(r.status, ReturnStatus::kOk);
    EXPECT_NEAR(r.range_m, truth.range_m(), tolerance);
    EXPECT_NEAR(r.bearing_rad, truth.bearing_rad(), 1e-8);
    EXPECT_NEAR(r.x_m, r.range_m * std::cos(r.bearing_rad), 1e-12 * r.range_m);
    EXPECT_NEAR(r.y_m, r.range_m * std::sin(r.bearing_rad), 1e-12 * r.range_m);
    const double half = stripe.half_pixel_px();
    const double a = exact_range(exact, stripe, i, -half);
    const double b = exact_range(exact, stripe, i, half);
    EXPECT_NEAR(r.range_near_m, std::min(a, b), 10.0 * tolerance);
    if (std::isinf(std::max(a, b))) {
      EXPECT_TRUE(std::isinf(r.range_far_m));
    } else {
      EXPECT_NEAR(r.range_far_m, std::max(a, b), 10.0 * tolerance);
    }
    EXPECT_LT(r.range_near_m, r.range_m);
    EXPECT_GT(r.range_far_m, r.range_m);
    const double slope =
        (exact_range(exact, stripe, i, 0.01) - exact_range(exact, stripe, i, -0.01)) / 0.02;
    EXPECT_NEAR(r.sigma_m, 0.1 * std::abs(slope), 1e-3 * r.sigma_m);
  }
  EXPECT_GT(good, static_cast<int>(stripe.size()) / 4);
}

TEST(ScanProjector, IsTheExactTriangulation) {
  expect_scan_is_exact(testing::paper_model());
  expect_scan_is_exact(testing::typical_model());
  expect_scan_is_exact(testing::typical_model(StripeAxis::kRows));
  expect_scan_is_exact(testing::wide_model());
}

TEST(ScanProjector, IsTheExactTriangulationOfFieldsAndRegions) {
  expect_scan_is_exact(testing::typical_model(), PixelGrid::top_field());
  expect_scan_is_exact(testing::typical_model(), PixelGrid::bottom_field());
  expect_scan_is_exact(testing::typical_model(), PixelGrid::region(64, 100));
}

// A batch that is not full still holds places of the image before, which must not be read in a
// smaller table. Only a sanitizer sees it, once the large table's memory is gone; that the returns
// are right is seen here.
TEST(ScanProjector, SmallImagesAfterALargeOneAreExactToo) {
  const StriperModel model = testing::typical_model();
  const Triangulator exact(model, 0);
  ScanProjector projector(model, {});
  PolarScan scan;
  projector.project(random_stripe(model), 0, scan);
  for (int left = 600; left < 612; ++left) {
    Stripe small;
    small.grid = PixelGrid::region(left, 0);
    small.reset(3);
    std::fill(small.across_px.begin(), small.across_px.end(), 400.0);
    std::fill(small.status.begin(), small.status.end(), ReturnStatus::kOk);
    projector.project(small, 0, scan);
    ASSERT_EQ(scan.returns.size(), 3U);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(scan.returns[static_cast<std::size_t>(i)].range_m,
                  exact.triangulate({left + i + 0.0, 400.0}).range_m(), 1e-6);
    }
  }
}

TEST(ScanProjector, RegionsThatWanderAreExactEachTimeTheyComeBack) {
  const StriperModel model = testing::typical_model();
  const Triangulator exact(model, 0);
  ScanProjector projector(model, {});
  PolarScan scan;
  for (int image = 0; image < 40; ++image) {
    const int left = image % 20 * 16;
    Stripe stripe;
    stripe.grid = PixelGrid::region(left, 0);
    stripe.reset(4);
    stripe.across_px[2] = 350.0;
    stripe.status[2] = ReturnStatus::kOk;
    projector.project(stripe, 0, scan);
    EXPECT_NEAR(scan.returns[2].range_m, exact.triangulate({left + 2.0, 350.0}).range_m(), 1e-6);
  }
}

TEST(ScanProjector, FarIsInfiniteWhereTheOuterRayMissesThePlane) {
  const StriperModel model = testing::paper_model();
  Stripe stripe = random_stripe(model);
  stripe.across_px[0] = model.camera.cy() + 0.3;  // The horizon is at cy.
  PolarScan scan;
  ScanProjector(model, {}).project(stripe, 0, scan);
  EXPECT_EQ(scan.returns[0].status, ReturnStatus::kOk);
  EXPECT_TRUE(std::isinf(scan.returns[0].range_far_m));
  EXPECT_TRUE(std::isfinite(scan.returns[0].range_near_m));
}

TEST(ScanProjector, RayAwayFromThePlaneIsBehind) {
  const StriperModel model = testing::paper_model();
  Stripe stripe = random_stripe(model);
  stripe.across_px[5] = 3.0;
  PolarScan scan;
  ScanProjector(model, {}).project(stripe, 0, scan);
  EXPECT_EQ(scan.returns[5].status, ReturnStatus::kBehind);
  EXPECT_TRUE(std::isnan(scan.returns[5].range_m));
  EXPECT_FALSE(std::isnan(scan.returns[5].v_px));
}

TEST(ScanProjector, RangeOutsideTheLimitsIsDoubtful) {
  const StriperModel model = testing::paper_model();
  Stripe stripe = random_stripe(model);
  const Triangulator exact(model, 0);
  stripe.across_px[320] = exact.project(2.0, 0.0).pixel.y();
  stripe.across_px[321] = exact.project(1.4, 0.0).pixel.y();
  PolarScan scan;
  ScanOptions options;
  options.max_range_m = 1.5;
  ScanProjector(model, options).project(stripe, 0, scan);
  EXPECT_EQ(scan.returns[320].status, ReturnStatus::kOutOfRange);
  EXPECT_NEAR(scan.returns[320].range_m, 2.0, 0.02);
  EXPECT_EQ(scan.returns[321].status, ReturnStatus::kOk);
}

TEST(ScanProjector, MissingStripeKeepsItsReason) {
  const StriperModel model = testing::typical_model();
  Stripe stripe = random_stripe(model);
  stripe.status[2] = ReturnStatus::kBlind;
  PolarScan scan;
  ScanProjector(model, {}).project(stripe, 0, scan);
  EXPECT_EQ(scan.returns[2].status, ReturnStatus::kBlind);
  EXPECT_TRUE(std::isnan(scan.returns[2].range_m));
}

TEST(ScanProjector, CalibrationErrorIsTheExactOneToAPercent) {
  for (StriperModel model : {testing::paper_model(), testing::typical_model(),
                             testing::typical_model(StripeAxis::kRows), testing::wide_model()}) {
    model.covariance = testing::plausible_covariance(model);
    const Triangulator exact(model, 0);
    PolarScan scan;
    ScanProjector(model, {}).project(random_stripe(model), 0, scan);
    int good = 0;
    for (const Return& r : scan.returns) {
      if (r.status != ReturnStatus::kOk || r.range_m > 20.0) continue;
      ++good;
      EXPECT_NEAR(r.sigma_cal_m / exact.sigma_cal_m({r.u_px, r.v_px}), 1.0, 0.01)
          << "at " << r.u_px << ", " << r.v_px << ", range " << r.range_m;
    }
    EXPECT_GT(good, 100);
  }
}

TEST(ScanProjector, WithoutACovarianceThereIsNoCalibrationError) {
  const StriperModel model = testing::typical_model();
  PolarScan scan;
  ScanProjector(model, {}).project(random_stripe(model), 0, scan);
  for (const Return& r : scan.returns) EXPECT_TRUE(std::isnan(r.sigma_cal_m));
}

TEST(ScanProjector, WithoutAModelOnlyTheImageSpeaks) {
  const Stripe stripe = random_stripe(testing::typical_model());
  PolarScan scan;
  ScanProjector().project(stripe, 0, scan);
  EXPECT_EQ(scan.returns[9].status, ReturnStatus::kOk);
  EXPECT_EQ(scan.returns[9].v_px, stripe.across_px[9]);
  EXPECT_TRUE(std::isnan(scan.returns[9].range_m));
}

TEST(ScanProjector, ModelWithoutALaserIsRefusedSayingWhatIsMissing) {
  StriperModel model = testing::typical_model();
  model.lasers.clear();
  EXPECT_THROW(ScanProjector(model, {}), Error);
}

TEST(ScanProjector, AllocatesNothingAfterTheFirstFrame) {
  const StriperModel model = testing::typical_model();
  ScanProjector projector(model, {});
  const Stripe stripe = random_stripe(model);
  PolarScan scan;
  projector.project(stripe, 0, scan);
  const testing::AllocationCounter counter;
  for (int i = 0; i < 10; ++i) projector.project(stripe, 0, scan);
  EXPECT_EQ(counter.count(), 0U);
}

}  // namespace
}  // namespace striper
