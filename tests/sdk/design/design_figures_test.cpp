// SPDX-License-Identifier: Apache-2.0
// Proves that the design's figures reproduce what the paper prints (Mertz et al. 2002, Table 1,
// "Background suppression"), obey the laws of a triangulating striper, and are refused out of
// bounds. That rendered frames have the predicted errors is proved by design_measured_test; that a
// real lens, filter and sensor are as their data sheets say by nothing here.
#include <cmath>
#include <limits>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/design/design_figures.hpp>
#include <striper/design/paper_table.hpp>
#include <striper/design/solar_spectrum.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::AllOf;
using testing::error_of;
using ::testing::HasSubstr;

constexpr double kDegree = M_PI / 180.0;

// The paper's baseline over s^2 + d^2 for an angle per line.
double outward_step_m(double range_m, double baseline_m, double line_rad) {
  const double alpha = std::atan2(baseline_m, range_m);
  return baseline_m / std::tan(alpha - line_rad) - range_m;
}

TEST(PaperTable1, AnglesAndRangeStepsToEveryPrintedDigit) {
  for (const PaperLens& lens : paper_table_1()) {
    EXPECT_EQ(fmt::format("{:.2f}", lens.resolution_deg),
              fmt::format("{:.2f}", lens.printed_resolution_deg));
    EXPECT_EQ(fmt::format("{:.1f}", 100.0 * lens.step_m),
              fmt::format("{:.1f}", 100.0 * lens.printed_step_m));
    EXPECT_NEAR(lens.step_m, outward_step_m(2.0, 0.5, 2.0 * lens.fov_deg * kDegree / 640.0), 1e-9);
  }
}

TEST(PaperTable1, DerivativeDoesNotReproduceTheWideLens) {
  EXPECT_EQ(fmt::format("{:.1f}", 100.0 * paper_table_1()[2].derivative_m), "4.9");
}

TEST(PaperTable1, MaximumRangeIsAScalingWithItsMisfit) {
  const auto lenses = paper_table_1();
  EXPECT_NEAR(lenses[0].scaled_max_range_m / lenses[0].printed_max_range_m - 1.0, 0.036, 1e-3);
  EXPECT_NEAR(lenses[1].scaled_max_range_m, 5.2, 1e-12);
  EXPECT_NEAR(lenses[2].scaled_max_range_m / lenses[2].printed_max_range_m - 1.0, 0.095, 2e-3);
}

TEST(PaperSun, LaserShutterFilterAndSignalToBackground) {
  StriperDesign design = paper_striper(55.0);
  const DesignFigures figures(design);
  EXPECT_NEAR(1.0 / figures.laser_to_sun(2.0), 8e4, 0.005 * 8e4);
  EXPECT_NEAR(figures.shutter_factor(), 13333.3, 0.1);  // The paper truncates: 13 000.
  EXPECT_NEAR(figures.filter_factor(), 40.0, 1e-9);
  const double ratio = figures.at(2.0).signal_to_background;
  EXPECT_NEAR(ratio, 6.67, 0.01);  // "About 7".
  design.camera.filter_width_nm = 10.0;
  EXPECT_NEAR(DesignFigures(design).at(2.0).signal_to_background / ratio, 2.5, 1e-12);
  design.sun.suppression = 40.0;
  EXPECT_NEAR(DesignFigures(design).at(2.0).signal_to_background, ratio, 1e-12);
}

TEST(PaperSun, RatioAndSnrAreNotTheSame) {
  const RangeFigures at = DesignFigures(paper_striper(55.0)).at(2.0);
  EXPECT_NEAR(at.signal_dn / at.background_dn, at.signal_to_background, 1e-9);
  EXPECT_GT(std::abs(at.snr - at.signal_to_background), 1.0);
}

TEST(SolarSpectrum, IsWithinTwoPercentOfTheReference) {
  EXPECT_NEAR(solar_irradiance_w_m2(280.0, 4000.0), 1000.4, 20.0);
  EXPECT_NEAR(solar_irradiance_w_m2(895.0, 905.0) / 10.0, 0.715, 0.05);  // Between water's lines.
  EXPECT_EQ(solar_irradiance_w_m2_nm(250.0), 0.0);
  EXPECT_EQ(solar_irradiance_w_m2_nm(5000.0), 0.0);
}

TEST(SolarSpectrum, IntegralsAddUp) {
  const double whole = solar_irradiance_w_m2(400.0, 1000.0);
  EXPECT_NEAR(solar_irradiance_w_m2(400.0, 777.7) + solar_irradiance_w_m2(777.7, 1000.0), whole,
              1e-9 * whole);
  EXPECT_NEAR(solar_suppression(700.0, 800.0), 1.0, 1e-12);
}

TEST(SolarSpectrum, DerivesASuppressionLikeThePapers) {
  // The paper's 40 is an input: its sensor's efficiency is not printed.
  EXPECT_GT(solar_suppression(900.0, 25.0), 25.0);
  EXPECT_LT(solar_suppression(900.0, 25.0), 45.0);
}

TEST(DesignFigures, FarLimitOfALevelCameraIsTheHorizon) {
  const DesignFigures figures(place_laser(equiangular_camera(640, 480, 55.0 * kDegree), 0.5, 0.0));
  EXPECT_TRUE(std::isinf(figures.far_m()));
  EXPECT_NEAR(figures.near_m(), 0.5 / std::tan(0.5 * 0.75 * 55.0 * kDegree), 1e-6);
  EXPECT_TRUE(std::isnan(figures.at(1.0).signal_dn));  // Nearer than the image shows.
}

TEST(DesignFigures, TiltedCameraHasBothLimits) {
  const double tilt = 30.0 * kDegree;
  const DesignFigures figures(place_laser(equiangular_camera(640, 480, 55.0 * kDegree), 0.5, tilt));
  const double half = 0.5 * 0.75 * 55.0 * kDegree;
  EXPECT_NEAR(figures.near_m(), 0.5 / std::tan(tilt + half), 1e-6);
  EXPECT_NEAR(figures.far_m(), 0.5 / std::tan(tilt - half), 1e-6);
}

TEST(DesignFigures, CoverageIsTheImageOrTheFan) {
  StriperDesign design = place_laser(equiangular_camera(640, 480, 55.0 * kDegree), 0.5, 0.0);
  design.laser.fan_rad = 40.0 * kDegree;
  EXPECT_NEAR(DesignFigures(design).coverage_rad(2.0), 40.0 * kDegree, 1e-6);
  design.laser.fan_rad = 120.0 * kDegree;
  const double shown = DesignFigures(design).coverage_rad(8.0);
  EXPECT_NEAR(shown, 55.0 * kDegree, 0.02);
}

TEST(DesignFigures, LightFallsWithTheSquareAndErrorsGrow) {
  const DesignFigures figures(paper_striper(30.0));
  const RangeFigures near = figures.at(3.0);
  const RangeFigures far = figures.at(6.0);
  EXPECT_NEAR(near.signal_dn / far.signal_dn, 4.0, 0.1);
  EXPECT_NEAR(near.background_dn, far.background_dn, 0.02 * near.background_dn);
  EXPECT_GT(far.sigma_m, 8.0 * near.sigma_m);  // Steps with the square, noise with the signal.
  EXPECT_GE(near.detection, far.detection);
}

TEST(DesignFigures, MaximumRangeIsWhereDetectionStops) {
  StriperDesign design = paper_striper(55.0);
  const DesignFigures figures(design);
  const double farthest_m = figures.max_range_m();
  EXPECT_NEAR(figures.at(farthest_m).detection, 0.99, 1e-6);
  design.false_alarm = 1e-6;
  EXPECT_LT(DesignFigures(design).max_range_m(), farthest_m);
  design.laser.pulse_energy_j = 0.0;
  EXPECT_TRUE(std::isnan(DesignFigures(design).max_range_m()));
}

TEST(DesignFigures, FieldsAndDarkExposuresAreCounted) {
  StriperDesign design = place_laser(equiangular_camera(640, 480, 55.0 * kDegree), 0.5, 0.0);
  EXPECT_EQ(DesignFigures(design).scan_rate_hz(), 30.0);
  const double step_m = DesignFigures(design).at(2.0).step_derivative_m;
  const double snr = DesignFigures(design).at(2.0).snr;
  design.camera.interlaced = true;
  EXPECT_EQ(DesignFigures(design).scan_rate_hz(), 60.0);
  EXPECT_NEAR(DesignFigures(design).at(2.0).step_derivative_m, 2.0 * step_m, 1e-12);
  design.camera.dark_subtracted = true;
  EXPECT_EQ(DesignFigures(design).scan_rate_hz(), 30.0);
  EXPECT_NEAR(DesignFigures(design).at(2.0).snr, snr / std::sqrt(2.0), 1e-9);
}

TEST(DesignFigures, SteadyLaserGivesWhatTheShutterLetsIn) {
  StriperDesign pulsed = paper_striper(55.0);
  StriperDesign steady = pulsed;
  steady.laser.power_w = pulsed.laser.pulse_energy_j / pulsed.camera.shutter_s;
  EXPECT_NEAR(DesignFigures(steady).at(2.0).signal_dn, DesignFigures(pulsed).at(2.0).signal_dn,
              1e-9);
}

TEST(DesignFigures, MeasuredLookGoesBeforeTheOptics) {
  StriperDesign design = paper_striper(55.0);
  design.reflectance = 0.85;
  StripeLook& look = design.model.lasers[0].look;
  look.width_px = 1.5;
  look.amplitude_at = {{1.0, 400.0}, {2.0, 100.0}};
  const DesignFigures figures(design);
  EXPECT_NEAR(figures.at(2.0).signal_dn, 100.0, 1e-9);
  EXPECT_NEAR(figures.at(4.0).signal_dn, 25.0, 1e-9);
  EXPECT_NEAR(figures.at(4.0).width_px, 1.5, 1e-12);
}

TEST(DesignFigures, TenRequirementsOfThePaper) {
  const std::vector<Requirement> ten = DesignFigures(paper_striper(55.0)).requirements();
  ASSERT_EQ(ten.size(), 10u);
  for (int n = 0; n < 10; ++n) EXPECT_EQ(ten[static_cast<std::size_t>(n)].number, n + 1);
  using Standing = Requirement::Standing;
  EXPECT_EQ(ten[0].standing, Standing::kMet);
  EXPECT_EQ(ten[1].standing, Standing::kNotMet);  // Only behind the paper's enclosure.
  EXPECT_EQ(ten[3].standing, Standing::kNotMet);  // A level camera sees nothing at .5 m.
  EXPECT_EQ(ten[5].standing, Standing::kNotComputed);
  EXPECT_EQ(ten[8].standing, Standing::kMet);
}

TEST(DesignFigures, EyeSafetyCountsThePulseOfEachField) {
  StriperDesign design = paper_striper(55.0);
  design.camera.interlaced = false;
  design.camera.rate_hz = 100.0;
  // 2.893 uJ a pulse at up to 60 Hz, 2.57 uJ at 100 Hz, 2.16 uJ at 200 Hz.
  design.laser.pulse_energy_j = 2.4e-6;
  EXPECT_EQ(DesignFigures(design).requirements()[1].standing, Requirement::Standing::kMet);
  design.camera.interlaced = true;
  EXPECT_EQ(DesignFigures(design).requirements()[1].standing, Requirement::Standing::kNotMet);
  design.camera.dark_subtracted = true;
  EXPECT_EQ(DesignFigures(design).requirements()[1].standing, Requirement::Standing::kMet);
}

void expect_refused(const StriperDesign& design, const std::string& field, const std::string& value,
                    const std::string& bound) {
  const Error error = error_of([&] { DesignFigures figures(design); });
  EXPECT_EQ(error.kind(), ErrorKind::kBadValue);
  EXPECT_THAT(error.what(), AllOf(HasSubstr(field), HasSubstr("is " + value), HasSubstr(bound)));
}

TEST(DesignFigures, RefusesWhatIsOutOfBounds) {
  StriperDesign design = paper_striper(55.0);
  design.laser.fan_rad = 3.2;
  expect_refused(design, "laser.fan_rad", "3.2", "to 3.14159");
  design = paper_striper(55.0);
  design.laser.power_w = -1.0;
  expect_refused(design, "laser.power_w", "-1", "at least 0");
  design = paper_striper(55.0);
  design.reflectance = std::numeric_limits<double>::quiet_NaN();
  expect_refused(design, "reflectance", "nan", "to 1");
  design = paper_striper(55.0);
  design.camera.shutter_s = 0.1;
  expect_refused(design, "camera.shutter_s", "0.1", "to 0.0333333");
  EXPECT_THAT(error_of([] { equiangular_camera(640, 480, 3.2); }).what(),
              AllOf(HasSubstr("fov_rad is 3.2"), HasSubstr("to 3.1")));
}

}  // namespace
}  // namespace striper
