// SPDX-License-Identifier: Apache-2.0
// Proves that the address of a camera is understood, and refused with the key and the value where
// it is wrong. Nothing here opens a camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/gige/gige_options.hpp>

#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

GigeOptions options_of(const std::string& text) {
  GigeOptions options = GigeOptions::from_uri(SourceUri::parse(text));
  options.validate();
  return options;
}

std::string refusal(const std::string& text) {
  const Error error = testing::error_of([&] { options_of(text); });
  EXPECT_EQ(error.kind(), ErrorKind::kUsage);
  return error.what();
}

TEST(GigeOptions, UnderstandEveryKey) {
  const GigeOptions options = options_of(
      "gige:ABC1?roi=8,16,320,240&binning=2x1&exposure_us=20&gain=3.5&black_level=2&fps=200&"
      "pixel_format=Mono12p&strobe=Line2,Line3&laser=0,1,dark&switching=host&trigger=Action2&"
      "action=0xc0ffee,2,4294967295&packet_size=8000&packet_delay_us=2.5&resend=no&"
      "frame_timeout_ms=250&buffers=8&socket_buffer_mb=4&heartbeat_ms=2000&reconnect=no&ptp=yes");
  EXPECT_EQ(options.name, "ABC1");
  EXPECT_EQ(options.region, cv::Rect(8, 16, 320, 240));
  EXPECT_EQ(options.binning, cv::Size(2, 1));
  EXPECT_EQ(options.exposure_us, 20.0);
  EXPECT_EQ(options.gain, 3.5);
  EXPECT_EQ(options.black_level, 2.0);
  EXPECT_EQ(options.frame_rate_hz, 200.0);
  EXPECT_EQ(options.pixel_format, "Mono12p");
  EXPECT_THAT(options.strobe_lines, ElementsAre("Line2", "Line3"));
  EXPECT_EQ(options.switching, LaserSwitching::kHost);
  EXPECT_EQ(options.trigger, "Action2");
  EXPECT_EQ(options.action, (ActionKeys{0xc0ffee, 2, 0xffffffff}));
  EXPECT_EQ(options.packet_bytes, 8000);
  EXPECT_EQ(options.packet_delay_us, 2.5);
  EXPECT_FALSE(options.resend);
  EXPECT_EQ(options.frame_timeout, std::chrono::milliseconds(250));
  EXPECT_EQ(options.buffers, 8);
  EXPECT_EQ(options.socket_buffer_mb, 4);
  EXPECT_EQ(options.heartbeat, std::chrono::milliseconds(2000));
  EXPECT_FALSE(options.reconnect);
  EXPECT_TRUE(options.ptp);
}

TEST(GigeOptions, PassOnTheCamerasOwnFeatures) {
  const GigeOptions options = options_of("gige:?ExposureTime=20&feature.userName=x&fps=5");
  EXPECT_EQ(options.features.size(), 2u);
  EXPECT_EQ(options.features.at("ExposureTime"), "20");
  EXPECT_EQ(options.features.at("userName"), "x");
  EXPECT_FALSE(options.is_usb);
  EXPECT_TRUE(options_of("u3v:SN").is_usb);
}

TEST(GigeOptions, RefuseQuotingKeyAndValue) {
  EXPECT_THAT(refusal("gige:?roi=1,2,3"), HasSubstr("roi=1,2,3 - expected left,top,width,height"));
  EXPECT_THAT(refusal("gige:?roi=0,0,0,5"), HasSubstr("roi=0,0,0,5"));
  EXPECT_THAT(refusal("gige:?binning=0"), HasSubstr("binning=0 - expected 2"));
  EXPECT_THAT(refusal("gige:?action=1,2"), HasSubstr("action=1,2 - expected device key, group"));
  EXPECT_THAT(refusal("gige:?action=1,2,4294967296"), HasSubstr("each below 2^32"));
  EXPECT_THAT(refusal("gige:?action=0x,2,3"), HasSubstr("action=0x,2,3 - expected"));
  EXPECT_THAT(refusal("gige:?action=1,2,3"), HasSubstr("action= needs trigger=Action"));
  EXPECT_THAT(refusal("gige:?trigger=Line2&action=1,2,3"), HasSubstr("there is trigger=Line2"));
  EXPECT_THAT(refusal("gige:?switching=magic"), HasSubstr("auto, sequencer or host"));
  EXPECT_THAT(refusal("gige:?exposure=20"), HasSubstr("unknown key 'exposure'"));
  EXPECT_THAT(refusal("gige:?exposure=20"), HasSubstr("exposure_us"));
  EXPECT_THAT(refusal("gige:?buffers=1"), HasSubstr("3 to 1024"));
  EXPECT_THAT(refusal("gige:?switching=host"), HasSubstr("needs strobe="));
  EXPECT_THAT(refusal("gige:?strobe=Line2,Line3,Line2"), HasSubstr("strobe= names Line2 twice"));
  EXPECT_THAT(refusal("gige:?strobe=Line2&laser=0,1"), HasSubstr("names laser 1"));
}

}  // namespace
}  // namespace striper
