// SPDX-License-Identifier: Apache-2.0
// Proves the plan's figures against closed forms and the 1991 report's printed numbers, and that
// each warning comes with its cause and goes with it. Does not prove that a truck does what its
// plan says.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/guidance/truck_plan.hpp>

namespace striper {
namespace {

constexpr double kInch = 0.0254;
constexpr double kFoot = 0.3048;
constexpr double kMph = 0.44704;
constexpr double kDegree = std::numbers::pi / 180.0;

bool warns(const TruckPlan& plan, PlanWarning code, const std::string& of = {}) {
  return std::any_of(plan.findings.begin(), plan.findings.end(),
                     [&](const PlanFinding& f) { return f.code == code && f.of == of; });
}

GuidanceConfig striper_truck(double rate_hz) {
  GuidanceConfig truck = report_truck();
  for (GuidanceBeam& beam : truck.beams) {
    beam.kind = BeamKind::kDiffuse;
    beam.rate_hz = rate_hz;
    beam.sweep_s = 0.0;
  }
  return truck;
}

TEST(TruckPlan, SupportsTheSpeedsOfTheSpacing) {
  struct Case {
    double rate_hz;
    double mph;
  };
  for (const Case& one : {Case{30, 6.8}, Case{60, 13.6}, Case{200, 45.5}, Case{176, 40.0}}) {
    const TruckPlan plan = plan_truck(striper_truck(one.rate_hz));
    for (const BeamPlan& beam : plan.beams) {
      EXPECT_NEAR(beam.speed_m_s / kMph, one.mph, 0.05) << one.rate_hz;
      EXPECT_NEAR(beam.speed_m_s, 4 * kInch * one.rate_hz, 1e-12);
      EXPECT_NEAR(beam.halved_m_s, 2 * beam.speed_m_s, 1e-12);
      EXPECT_NEAR(beam.spacing_m, 40 * kMph / one.rate_hz, 1e-12);
    }
  }
}

TEST(TruckPlan, OfTheReportsTruckHasItsFigures) {
  const TruckPlan plan = plan_truck(report_truck());
  // The polynomial's weights at 0: -40/48, 64/39, 40/208.
  EXPECT_NEAR(plan.noise_gain, std::hypot(40.0 / 48, 64.0 / 39, 40.0 / 208), 1e-12);
  EXPECT_NEAR(plan.noise_gain, 1.850, 1e-3);
  EXPECT_NEAR(plan.bend_error_m / kInch, -0.01955, 5e-6);
  EXPECT_NEAR(plan.acceleration_m_s2 / 9.80665, 2.14, 5e-3);
  EXPECT_NEAR(plan.speed_in_bend_m_s / kMph, 13.7, 0.05);
  EXPECT_NEAR(plan.radius_at_speed_m / kFoot, 428, 0.5);
  EXPECT_NEAR(plan.count_m / kInch, 12 / 11.725, 1e-9);
  EXPECT_NEAR(plan.preview_s, 8 * kFoot / (40 * kMph), 1e-12);
  EXPECT_NEAR(plan.beams[0].grazing_rad / kDegree, 19.50, 5e-3);
  EXPECT_NEAR(plan.beams[1].grazing_rad / kDegree, 29.54, 5e-3);
  EXPECT_NEAR(plan.beams[0].skew_m / kInch, 0.96, 5e-3);
  EXPECT_TRUE(std::isnan(plan.beams[0].observation_rad));
}

TEST(TruckPlan, OfTwoBeamsIsAsWrongInABendAsTheReportSays) {
  GuidanceConfig truck = report_truck();
  truck.beams[1].use = BeamUse::kOff;
  const TruckPlan plan = plan_truck(truck);
  EXPECT_NEAR(plan.bend_error_m / kInch, 7.7298, 5e-5);
  EXPECT_NEAR(plan.noise_gain, std::sqrt(0.5), 1e-12);
  EXPECT_TRUE(warns(plan, PlanWarning::kBendError));
  EXPECT_FALSE(warns(plan_truck(report_truck()), PlanWarning::kBendError));
}

TEST(TruckPlan, SaysWhatAStriperSeesOfBeads) {
  GuidanceConfig truck = striper_truck(200);
  // The slant of 2.6 m: 10.9 degrees.
  truck.beams[0].height_m = std::sqrt(2.6 * 2.6 - truck.beams[0].x_m * truck.beams[0].x_m);
  const TruckPlan plan = plan_truck(truck);
  EXPECT_NEAR(plan.beams[0].observation_rad / kDegree, 10.9, 0.05);
  EXPECT_FALSE(warns(plan, PlanWarning::kRetroreflection, "front"));
  truck.beams[0].kind = BeamKind::kRetro;
  truck.beams[0].head = "front";
  EXPECT_TRUE(warns(plan_truck(truck), PlanWarning::kRetroreflection, "front"));
}

TEST(TruckPlan, WarnsOfEachThingThatLimits) {
  const GuidanceConfig report = report_truck();
  const TruckPlan plan = plan_truck(report);
  EXPECT_TRUE(warns(plan, PlanWarning::kAcceleration));
  EXPECT_TRUE(warns(plan, PlanWarning::kFeedback, "rear"));
  EXPECT_TRUE(warns(plan, PlanWarning::kOdometer));
  EXPECT_FALSE(warns(plan, PlanWarning::kSpacing, "front"));
  const auto feedback =
      std::find_if(plan.findings.begin(), plan.findings.end(),
                   [](const PlanFinding& f) { return f.code == PlanWarning::kFeedback; });
  EXPECT_NEAR(feedback->value, 1.24, 5e-3);

  GuidanceConfig truck = report;
  truck.beams[2].use = BeamUse::kOldOnly;
  truck.odometer.counts_per_m = 400;
  truck.guns[0].gun.on_delay_s = 0.2;
  TruckPlanOptions options;
  options.speed_m_s = 20 * kMph;
  options.radius_m = 100.0;
  EXPECT_TRUE(plan_truck(truck, options).findings.empty());
  EXPECT_EQ(plan_truck(truck, options).limits.front().by, "gun gun");
  EXPECT_NEAR(plan_truck(truck, options).limits.front().speed_m_s, 8 * kFoot / 0.2, 1e-9);
  truck.guns[0].gun.on_delay_s = 0.5;
  EXPECT_TRUE(warns(plan_truck(truck, options), PlanWarning::kValve, "gun"));
  truck.beams[0].samples = 30;
  EXPECT_TRUE(warns(plan_truck(truck, options), PlanWarning::kStep, "front"));
  truck.beams[0].rate_hz = 60;
  EXPECT_TRUE(warns(plan_truck(truck, options), PlanWarning::kSpacing, "front"));
  options.radius_m = 7.0;
  EXPECT_TRUE(warns(plan_truck(truck, options), PlanWarning::kWindow, "front"));
  truck.beams[1].use = truck.beams[2].use = BeamUse::kOff;
  EXPECT_TRUE(warns(plan_truck(truck, options), PlanWarning::kOneBeam));
}

TEST(TruckPlan, RefusesWhatIsNoTruckAndNoSpeed) {
  TruckPlanOptions options;
  options.speed_m_s = 0.0;
  EXPECT_THROW(plan_truck(report_truck(), options), Error);
  GuidanceConfig truck = report_truck();
  truck.beams.clear();
  EXPECT_THROW(plan_truck(truck), Error);
}

}  // namespace
}  // namespace striper
