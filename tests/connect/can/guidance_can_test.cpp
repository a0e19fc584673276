// SPDX-License-Identifier: Apache-2.0
// Proves what stands in the frames of guidance, byte by byte, at and beyond the ends of the scales;
// when they are sent; that all is safe at the end, however it comes; addresses. That the bytes are
// those of data/can/guidance.dbc is can_test.py's, a real bus vcan.sh's.
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/can/guidance_can.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::vector<int> bytes(const CanFrame& frame) {
  return {frame.data.begin(), frame.data.begin() + frame.size};
}

LateralLine line_of(double lateral_m, double sigma_m, double volts, PathState state) {
  LateralLine line;
  line.lateral_m = lateral_m;
  line.sigma_m = sigma_m;
  line.volts = volts;
  line.beams = 3;
  line.state = state;
  return line;
}

TEST(GuidanceFrames, LateralIsInTenthsOfAMillimetreLowestByteFirst) {
  GuidanceFrames frames;
  const CanFrame frame = frames.lateral(line_of(0.0258, 0.0014, -0.253, PathState::kBridging));
  EXPECT_EQ(frame.id, 0x320U);
  // 258 = 0x102, 14, -253 = 0xFF03, state 1 and 3 beams, the first of its kind.
  EXPECT_THAT(bytes(frame), ElementsAre(0x02, 0x01, 14, 0, 0x03, 0xFF, 0x31, 0));
  EXPECT_EQ(frames.lateral({}).data[7], 1);
}

TEST(GuidanceFrames, WhatDoesNotFitIsAtTheEndAndWhatIsNotKnownHasAValueOfItsOwn) {
  GuidanceFrames frames;
  EXPECT_THAT(bytes(frames.lateral(line_of(-40.0, 70.0, 99.0, PathState::kFault))),
              ElementsAre(0x01, 0x80, 0xFE, 0xFF, 0xFF, 0x7F, 0x33, 0));
  EXPECT_THAT(bytes(frames.lateral(line_of(40.0, -1.0, -99.0, PathState::kTracking))),
              ElementsAre(0xFF, 0x7F, 0, 0, 0x01, 0x80, 0x30, 1));
  EXPECT_THAT(bytes(frames.lateral(line_of(kUnknown, kUnknown, kUnknown, PathState::kLost))),
              ElementsAre(0x00, 0x80, 0xFF, 0xFF, 0x00, 0x80, 0x32, 2));
}

TEST(GuidanceFrames, WayIsInMillimetresAndCountsWrap) {
  GuidanceFrames frames(0x100);
  LateralLine line;
  line.odometer_counts = (std::int64_t{1} << 32) - 2;
  line.distance_m = -1.5;
  const CanFrame frame = frames.way(line);
  EXPECT_EQ(frame.id, 0x103U);
  EXPECT_THAT(bytes(frame), ElementsAre(0xFE, 0xFF, 0xFF, 0xFF, 0x24, 0xFA, 0xFF, 0xFF));
}

TEST(GuidanceFrames, FaultsAreTheirPlacesInTheList) {
  GuidanceFrames frames;
  const CanFrame frame = frames.fault({3.0, GuidanceFault::kMirror, FaultAction::kHold, 0.0123});
  EXPECT_EQ(frame.id, 0x322U);
  EXPECT_THAT(bytes(frame), ElementsAre(4, 1, 123, 0, 0));
}

// What was sent, kept.
class Kept : public CanPort {
 public:
  explicit Kept(std::vector<CanFrame>& frames) : frames_(frames) {}
  void send(double /*time_s*/, const CanFrame& frame) noexcept override {
    frames_.push_back(frame);
    count(0);
  }
  void close() override {}

 private:
  std::vector<CanFrame>& frames_;
};

struct Sent {
  std::vector<CanFrame> frames;
  GuidanceConfig config = report_truck();

  std::unique_ptr<GuidanceCan> open() {
    config.output.volts_safe = 1.0;
    return std::make_unique<GuidanceCan>(config, std::make_unique<Kept>(frames));
  }
  // The frames of one kind since the last call.
  std::vector<std::vector<int>> take(std::uint32_t kind) {
    std::vector<std::vector<int>> found;
    for (const CanFrame& frame : frames) {
      if (frame.id == GuidanceFrames::kFirstId + kind) found.push_back(bytes(frame));
    }
    frames.clear();
    return found;
  }
};

constexpr std::uint32_t kLateral = 0;
constexpr std::uint32_t kGuns = 1;

TEST(GuidanceCan, SendsGunsWhenTheyChangeAndWithEachScan) {
  Sent sent;
  const auto can = sent.open();
  can->switch_gun(2, true, 1.0);
  can->switch_gun(0, true, 1.1);
  can->lateral({});
  can->switch_gun(2, false, 1.2);
  can->switch_laser_off(1.3);
  EXPECT_THAT(sent.take(kGuns),
              ElementsAre(ElementsAre(4, 0, 0), ElementsAre(5, 0, 1), ElementsAre(5, 0, 2),
                          ElementsAre(1, 0, 3), ElementsAre(1, 1, 4)));
}

// Scans may have stopped with the fault.
TEST(GuidanceCan, AFaultThatStopsSendsTheSafeVoltageByItself) {
  Sent sent;
  const auto can = sent.open();
  can->lateral(line_of(0.01, 0.001, -3.0, PathState::kTracking));
  sent.frames.clear();
  can->fault({1.0, GuidanceFault::kTime, FaultAction::kWarn, 0.0});
  EXPECT_THAT(sent.take(kLateral), ElementsAre());
  can->fault({1.0, GuidanceFault::kBeamSilent, FaultAction::kHold, 0.0});
  EXPECT_THAT(sent.take(kLateral), ElementsAre(ElementsAre(100, 0, 10, 0, 0x48, 0xF4, 0x33, 1)));
  can->fault({1.0, GuidanceFault::kOdometer, FaultAction::kStop, 0.0});
  EXPECT_THAT(sent.take(kLateral), ElementsAre(ElementsAre(100, 0, 10, 0, 0xE8, 0x03, 0x33, 2)));
}

TEST(GuidanceCan, IsSafeAtTheEndHoweverItComes) {
  for (const bool is_finished : {true, false}) {
    Sent sent;
    auto can = sent.open();
    can->lateral(line_of(0.01, 0.001, -3.0, PathState::kTracking));
    can->switch_gun(0, true, 1.0);
    sent.frames.clear();
    if (is_finished) can->finish();
    can.reset();
    ASSERT_EQ(sent.frames.size(), 2U);
    EXPECT_THAT(bytes(sent.frames[0]), ElementsAre(0, 0, 2));  // Guns first.
    EXPECT_THAT(bytes(sent.frames[1]), ElementsAre(0x00, 0x80, 0xFF, 0xFF, 0xE8, 0x03, 0x02, 1));
  }
}

TEST(GuidanceCan, MoreGunsThanBitsAreRefused) {
  Sent sent;
  sent.config.guns.resize(9, sent.config.guns.front());
  EXPECT_THROW(sent.open(), Error);
}

TEST(CanPort, ALineOfALogIsThatOfCanUtils) {
  std::string lines;
  append_candump_line(lines, 12.0345678, {0x320, 3, {0x00, 0xAB, 0x0C}});
  append_candump_line(lines, 1763900000.25, {0x7, 0, {}});
  EXPECT_EQ(lines, "(12.034568) can0 320#00AB0C\n(1763900000.250000) can0 007#\n");
}

std::string refusal(const std::string& address) {
  try {
    open_guidance_can(address, report_truck());
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(CanPort, RefusesWhatIsNoAddress) {
  EXPECT_THAT(refusal("can:"), HasSubstr("can:INTERFACE or candump:FILE"));
  EXPECT_THAT(refusal("csv:x"), HasSubstr("can:INTERFACE or candump:FILE"));
  EXPECT_THAT(refusal("candump:/dev/null?id=2045"), HasSubstr("from 0 to 2044"));
  EXPECT_THAT(refusal("candump:/dev/null?bitrate=5"), HasSubstr("bitrate"));
  EXPECT_EQ(refusal("candump:/dev/null?id=2044"), "");
  // No such interface; or, of a kernel without CAN, that.
  EXPECT_THAT(refusal("can:nowhere7"), ::testing::AnyOf(HasSubstr("no CAN interface 'nowhere7'"),
                                                        HasSubstr("kernel has no CAN")));
}

}  // namespace
}  // namespace striper
