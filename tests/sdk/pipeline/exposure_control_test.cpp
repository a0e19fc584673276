// SPDX-License-Identifier: Apache-2.0
// Proves that automatic exposure keeps the stripe where light becomes a hundred times as bright in
// a fifth of a second, as at a tunnel's exit, and comes to rest there, whatever the camera's rate
// and the delay between setting and seeing; that it finds a stripe that is clipped or lost in the
// dark; and that it leaves alone what is right. The camera is a linear one with shot noise; not
// proved: what a real camera does between two settings.
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/pipeline/exposure_control.hpp>
#include <striper/pipeline/scanner.hpp>

#include "support/error_of.hpp"
#include "support/models.hpp"
#include "support/random.hpp"
#include "support/synthetic_stripe.hpp"

namespace striper {
namespace {

using testing::normal;
using testing::uniform;

constexpr int kColumns = 120;
constexpr int kRows = 100;

StriperModel small_model() {
  StriperModel model = testing::paper_model();
  const double f = 0.5 * kColumns / std::tan(0.5);
  model.camera = CameraModel(kColumns, kRows, f, f, 0.5 * (kColumns - 1), 0.5 * (kRows - 1));
  model.lasers[0].plane = LaserPlane(Eigen::Vector3d::UnitY(), 0.2);
  return model;
}

/// A camera before a wall of some texture; what it is told holds after a delay.
class LinearCamera {
 public:
  struct Light {
    double laser = 0.0;     // DN per microsecond,
    double daylight = 0.0;  // of white.
  };

  LinearCamera(double exposure_us, int delay)
      : told_(static_cast<std::size_t>(delay) + 1, exposure_us),
        controls_("test", {{"exposure_us", ControlType::kNumber, "us",
                            [this] {
                              return ControlState{{told_.back()}, {1.0}, {5000.0}};
                            },
                            [this](const ControlValue& v) { told_.back() = v[0]; }}}) {
    for (double& column : texture_) column = uniform(0.3, 1.0);
  }

  Controls& controls() { return controls_; }

  Frame take(const Light& light) {
    const double exposure_us = told_.front();
    told_.pop_front();
    told_.push_back(told_.empty() ? exposure_us : told_.back());
    Frame frame;
    frame.image.create(kRows, kColumns, CV_8UC1);
    for (int v = 0; v < kRows; ++v) {
      for (int u = 0; u < kColumns; ++u) {
        const double white = texture_[static_cast<std::size_t>(u)];
        const double stripe = testing::box_gaussian(v, kStripe, 1.0, light.laser);
        const double dn = exposure_us * white * (stripe + light.daylight);
        // 100 electrons a DN.
        const double seen = dn + normal(0.0, std::sqrt(1.0 + dn / 100.0));
        frame.image.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(seen);
      }
    }
    frame.sensor_size = frame.image.size();
    frame.sequence = sequence_++;
    frame.exposure_ns = std::llround(1e3 * exposure_us);
    return frame;
  }

  static constexpr double kStripe = 70.3;

 private:
  std::deque<double> told_;  // What holds for the next frame first.
  std::array<double, kColumns> texture_{};
  Controls controls_;
  std::uint64_t sequence_ = 0;
};

/// The camera, its scanner and the control, frame by frame.
class Drive {
 public:
  Drive(double exposure_us, int delay, const char* pattern)
      : camera_(exposure_us, delay),
        pattern_(IlluminationPattern::parse(pattern)),
        control_(camera_.controls()) {
    ScannerOptions options;
    options.ambient.pattern = pattern_;
    scanner_.emplace(small_model(), options);
  }

  void step(LinearCamera::Light light) {
    if (pattern_.at(frames_++).is_dark()) light.laser = 0.0;
    const Frame frame = camera_.take(light);
    const ScanSpan scans = scanner_->process(frame);
    for (const PolarScan& scan : scans) {
      parts_.push_back(part_found(scan));
      clipped_ += is_clipped(scan) ? 1 : 0;
    }
    control_.update(frame, scans);
  }

  // Scans without the stripe in most of their columns.
  long lost() const {
    return std::count_if(parts_.begin(), parts_.end(), [](double part) { return part < 0.5; });
  }
  // Scans of which most is clipped.
  long clipped() const { return clipped_; }
  double last_part() const { return parts_.back(); }
  const ExposureControl& control() const { return control_; }

 private:
  static bool is_clipped(const PolarScan& scan) {
    const auto clipped =
        std::count_if(scan.returns.begin(), scan.returns.end(), [](const Return& r) {
          return r.status == ReturnStatus::kSaturated || r.status == ReturnStatus::kBlind;
        });
    return 2 * clipped > kColumns;
  }
  static double part_found(const PolarScan& scan) {
    const auto found = std::count_if(scan.returns.begin(), scan.returns.end(), [](const Return& r) {
      return r.status == ReturnStatus::kOk && std::abs(r.v_px - LinearCamera::kStripe) < 1.0;
    });
    return static_cast<double>(found) / kColumns;
  }

  LinearCamera camera_;
  IlluminationPattern pattern_;
  ExposureControl control_;
  std::optional<Scanner> scanner_;
  std::uint64_t frames_ = 0;
  long clipped_ = 0;
  std::vector<double> parts_;  // Of the columns, with the stripe, scan by scan.
};

// Out of a tunnel, at any rate and delay. @return the drive, once it has come to rest.
std::unique_ptr<Drive> leave_tunnel(const char* pattern) {
  constexpr double kRamp_s = 0.2;
  const double rate_hz = uniform(30.0, 200.0);
  const int delay = static_cast<int>(uniform(0.0, 2.99));
  const double laser = uniform(1.0, 2.0);             // DN per microsecond.
  const double tunnel = laser * uniform(0.01, 0.03);  // Outside: one to three times the laser.
  auto drive = std::make_unique<Drive>(60.0, delay, pattern);
  for (int i = 0; i < 20; ++i) drive->step({laser, tunnel});
  EXPECT_EQ(drive->lost(), 0);
  for (double t_s = 0.0; t_s < kRamp_s; t_s += 1.0 / rate_hz) {
    drive->step({laser, tunnel * std::pow(100.0, t_s / kRamp_s)});
  }
  for (int i = 0; i < 20; ++i) drive->step({laser, 100.0 * tunnel});
  const std::uint64_t changes = drive->control().changes();
  for (int i = 0; i < 30; ++i) drive->step({laser, 100.0 * tunnel});
  EXPECT_LE(drive->control().changes() - changes, 1U);  // At rest.
  EXPECT_GT(drive->last_part(), 0.9);
  return drive;
}

TEST(ExposureControl, TunnelExitLosesThreeScansAtMostAndComesToRest) {
  for (int drive = 0; drive < 20; ++drive) {
    SCOPED_TRACE(drive);
    EXPECT_LE(leave_tunnel("0")->lost(), 3);
  }
}

// What is lost more (up to seven scans) no exposure could save: daylight that changes by a third
// from a lit exposure to the dark one beside it counts as something that moves.
TEST(ExposureControl, TunnelExitWithDarkExposuresClipsThreeScansAtMost) {
  for (int drive = 0; drive < 6; ++drive) {
    SCOPED_TRACE(drive);
    EXPECT_LE(leave_tunnel("0,dark")->clipped(), 3);
  }
}

TEST(ExposureControl, LeavesAloneWhatIsRight) {
  Drive camera(60.0, 1, "0");
  for (int i = 0; i < 60; ++i) camera.step({2.2, 0.02});
  EXPECT_LE(camera.control().changes(), 1U);
  EXPECT_EQ(camera.lost(), 0);
}

TEST(ExposureControl, FindsAStripeThatIsClippedOrInTheDark) {
  for (const double first_us : {3.0, 4000.0}) {
    SCOPED_TRACE(first_us);
    Drive camera(first_us, 1, "0");
    for (int i = 0; i < 30; ++i) camera.step({1.5, 0.02});
    EXPECT_GT(camera.last_part(), 0.95);
    // White in the stripe is at half of the full scale, within the tolerance.
    EXPECT_NEAR(camera.control().exposure_us() * 1.5 / 255.0, 0.55, 0.25);
  }
}

TEST(ExposureControl, NeedsAnExposureThatCanBeSet) {
  Controls none;
  EXPECT_EQ(testing::error_of([&] { ExposureControl control(none); }).kind(),
            ErrorKind::kUnsupported);
}

// The time a laser was on is counted whoever sets the exposure.
TEST(Scanner, CountsHowLongLasersWereOn) {
  ScannerOptions options;
  options.ambient.pattern = IlluminationPattern::parse("0");
  Scanner scanner(small_model(), options);
  LinearCamera camera(250.0, 0);
  for (int i = 0; i < 8; ++i) scanner.process(camera.take({0.5, 0.02}));
  EXPECT_NEAR(scanner.statistics().lit_s, 8 * 250e-6, 1e-12);
}

}  // namespace
}  // namespace striper
