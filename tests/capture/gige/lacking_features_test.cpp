// SPDX-License-Identifier: Apache-2.0
// Proves, with a GenICam description from which one feature after the other is cut, that a camera
// which lacks what is asked for is refused with a message that names it, and that one which lacks
// what is not needed works: every feature that the source touches is in one of the two tables. (The
// Gev... ones stand for registers that every camera has; Aravis knows them without a description.)
#include <chrono>

#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>

#include "capture/gige/virtual_striper.hpp"

namespace striper::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

VirtualStriper camera_without(std::set<std::string> lacking) {
  detail::CameraFaults faults;
  faults.lacking = std::move(lacking);
  return VirtualStriper(std::make_shared<PatternScene>(cv::Size(64, 48), 8, 200.0), {}, faults);
}

/// What becomes of opening the camera and taking a frame.
std::string outcome(const VirtualStriper& striper, const std::string& query) {
  try {
    const auto source = striper.open(query);
    source->start();
    Frame frame;
    if (source->next(frame, 3000ms) != NextStatus::kFrame) return "no frame";
    return frame.status == FrameStatus::kOk ? "works" : frame.status_detail;
  } catch (const Error& error) {
    return error.what();
  }
}

struct Needed {
  std::set<std::string> lacking;
  const char* query;
  const char* message;
};

void PrintTo(const Needed& needed, std::ostream* out) {
  *out << fmt::format("'{}' without {}", needed.query, fmt::join(needed.lacking, ", "));
}

class NeededFeature : public ::testing::TestWithParam<Needed> {};

TEST_P(NeededFeature, IsNamedWhereItIsMissing) {
  const VirtualStriper striper = camera_without(GetParam().lacking);
  EXPECT_THAT(outcome(striper, GetParam().query), HasSubstr(GetParam().message));
  EXPECT_FALSE(striper.camera->statistics().is_controlled) << "the camera is let go";
  EXPECT_FALSE(striper.camera->statistics().is_laser_armed);
}

const Needed kNeeded[] = {
    {{"PixelFormat"}, "", "PixelFormat"},
    {{"Width"}, "", "Width"},
    {{"Height"}, "", "Height"},
    {{"SensorWidth"}, "", "it has no feature SensorWidth or WidthMax"},
    {{"SensorHeight"}, "", "it has no feature SensorHeight or HeightMax"},
    {{"PayloadSize"}, "", "PayloadSize"},
    {{"AcquisitionStart"}, "", "AcquisitionStart"},
    {{"BinningHorizontal"}, "binning=2", "cannot set the binning: it has no feature Binning"},
    {{"BinningVertical"}, "binning=2", "cannot set the binning: it has no feature BinningVertical"},
    {{"OffsetX"}, "roi=0,0,32,32", "cannot set the region of interest: it has no feature OffsetX"},
    {{"OffsetY"}, "roi=0,0,32,32", "cannot set the region of interest: it has no feature OffsetY"},
    {{"ExposureTime"}, "exposure_us=20", "cannot set the exposure: it has no feature ExposureTime"},
    {{"Gain"}, "gain=3", "cannot set the gain: it has no feature Gain"},
    {{"BlackLevel"}, "black_level=3", "cannot set the black level: it has no feature BlackLevel"},
    {{"AcquisitionFrameRate"}, "fps=20", "cannot set the frame rate: it has no feature Acquis"},
    {{"PtpEnable", "GevIEEE1588"}, "ptp=yes", "cannot set the PTP: it has no feature PtpEnable"},
    {{"TriggerMode"}, "trigger=Software", "cannot set the trigger: it has no feature TriggerMode"},
    {{"TriggerSource"}, "trigger=Software", "no feature 'TriggerSource'"},
    {{"TriggerSoftware"}, "trigger=software", "cannot set the software trigger: it has no feat"},
    {{"ActionDeviceKey"},
     "trigger=Action&action=1,2,3",
     "cannot set the action keys: it has no feature ActionDev"},
    {{"ActionGroupKey"},
     "trigger=Action&action=1,2,3",
     "cannot set the action keys: it has no feature ActionGro"},
    {{"ActionGroupMask"},
     "trigger=Action&action=1,2,3",
     "action keys: it has no feature ActionGroupMask"},
    {{"TriggerSource.Action1"},
     "trigger=Action",
     "TriggerSource=Action - expected one of Software"},
    {{"TriggerSource"}, "trigger=Action", "no feature 'TriggerSource'"},
    {{"LineSelector"}, "strobe=Line2", "cannot set the strobe line: it has no feature LineSel"},
    {{"LineSource"}, "strobe=Line2", "source of the strobe line: it has no feature LineSource"},
    {{"LineSource.ExposureActive"}, "strobe=Line2", "Line2 cannot be ExposureActive: its LineSo"},
    {{"LineSource.Off", "UserOutputSelector"}, "strobe=Line2", "Line2 cannot be turned off"},
    {{"LineSource.Off", "UserOutputValue"}, "strobe=Line2", "Line2 cannot be turned off"},
    {{"SequencerConfigurationMode", "TriggerSoftware"},
     "strobe=Line2&laser=0,dark",
     "neither a sequencer nor a software trigger"},
    {{"SequencerSetSave"}, "strobe=Line2&laser=0,dark&switching=sequencer", "SequencerConf"},
    {{"SequencerMode"}, "strobe=Line2&laser=0,dark&switching=sequencer", "SequencerMode"},
    {{"SequencerSetSelector"}, "strobe=Line2&laser=0,dark&switching=sequencer", "SequencerSetSel"},
    {{"SequencerSetNext"}, "strobe=Line2&laser=0,dark&switching=sequencer", "SequencerSetNext"},
    {{"TriggerSoftware"}, "strobe=Line2&laser=0,dark&switching=host", "TriggerSoftware"},
};

INSTANTIATE_TEST_SUITE_P(Each, NeededFeature, ::testing::ValuesIn(kNeeded));

struct Spared {
  const char* lacking;
  const char* query;
};

void PrintTo(const Spared& spared, std::ostream* out) {
  *out << fmt::format("'{}' without {}", spared.query, spared.lacking);
}

class SparedFeature : public ::testing::TestWithParam<Spared> {};

TEST_P(SparedFeature, IsNotNeeded) {
  const VirtualStriper striper = camera_without({GetParam().lacking});
  EXPECT_EQ(outcome(striper, GetParam().query), "works") << "without " << GetParam().lacking;
}

const Spared kSpared[] = {
    {"AcquisitionMode", ""},
    {"AcquisitionStop", ""},
    {"AcquisitionFrameRate", ""},
    {"ExposureTime", ""},
    {"OffsetX", ""},
    {"BinningHorizontal", ""},
    {"TriggerMode", ""},
    {"TriggerSelector", "trigger=software"},
    {"GevHeartbeatTimeout", ""},
    {"GevSCPD", "packet_delay_us=2"},
    {"GevSCPSFireTestPacket", ""},
    {"TLParamsLocked", ""},
    {"LineMode", "strobe=Line2"},
    {"LineStatusAll", "strobe=Line2"},
    {"ChunkModeActive", "strobe=Line2&laser=0,dark"},
    {"ChunkSelector", "strobe=Line2&laser=0,dark"},
    {"ChunkSelector.LineStatusAll", "strobe=Line2&laser=0,dark"},
    {"ChunkEnable", "strobe=Line2&laser=0,dark"},
    {"ChunkLineStatusAll", "strobe=Line2&laser=0,dark"},
    {"SequencerPathSelector", "strobe=Line2&laser=0,dark"},
    {"SequencerSetStart", "strobe=Line2&laser=0,dark"},
    {"SequencerConfigurationMode", "strobe=Line2&laser=0,dark"},
    {"TriggerSoftware", "strobe=Line2&laser=0,dark"},
    {"PtpDataSetLatch", "ptp=yes"},
    {"PtpStatus", "ptp=yes"},
};

INSTANTIATE_TEST_SUITE_P(Each, SparedFeature, ::testing::ValuesIn(kSpared));

TEST(WrittenFeature, IsReadBack) {
  const VirtualStriper striper = camera_without({});
  const auto source = striper.open(
      "exposure_us=250&gain=6&black_level=3&fps=50&packet_size=1500&packet_delay_us=2");
  source->start();
  Frame frame;
  ASSERT_EQ(source->next(frame, 3000ms), NextStatus::kFrame);
  EXPECT_EQ(frame.exposure_ns, 250'000);
  EXPECT_NEAR(source->info().picture_rate_hz, 50.0, 1e-6);
  EXPECT_EQ(source->stream_statistics().packet_bytes, 1500);
}

TEST(WrittenFeature, ThatIsNotKeptIsRefusedWithWhatIsReadBack) {
  detail::CameraFaults faults;
  faults.stuck = {"ExposureTime", "GevSCPD", "BlackLevel", "PixelFormat", "PtpEnable"};
  const VirtualStriper striper(std::make_shared<PatternScene>(cv::Size(64, 48), 8, 200.0), {},
                               faults);
  EXPECT_THAT(outcome(striper, "exposure_us=250"),
              HasSubstr("ExposureTime was set to 250 and reads"));
  EXPECT_THAT(outcome(striper, "black_level=9"), HasSubstr("BlackLevel was set to 9 and reads 0"));
  EXPECT_THAT(outcome(striper, "pixel_format=Mono12"),
              HasSubstr("PixelFormat was set to Mono12 and reads Mono8"));
  EXPECT_THAT(outcome(striper, "ptp=yes"), HasSubstr("PtpEnable was set to yes and reads"));
  EXPECT_THAT(outcome(striper, "packet_delay_us=20"),
              HasSubstr("packet_delay_us=20 - the camera took 0"));
}

}  // namespace
}  // namespace striper::testing
