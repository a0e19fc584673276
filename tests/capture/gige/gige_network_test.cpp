// SPDX-License-Identifier: Apache-2.0
// Proves that cameras are listed with what tells them apart and who holds them, and that what keeps
// one from being reached is told from what does not, with a cure: over real packets to the virtual
// camera on loopback. Other subnets, filters and firewalls are tried with a network of their own in
// tests/end_to_end/gige_network_test.py.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/capture/list_cameras.hpp>
#include <striper/gige/gige_network.hpp>

#include "capture/gige/virtual_striper.hpp"

namespace striper::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::StartsWith;

VirtualStriper small_striper(VirtualCameraOptions options = {}) {
  return VirtualStriper(std::make_shared<PatternScene>(cv::Size(64, 48), 8, 50.0),
                        std::move(options));
}

auto finding(EventCode code, const std::string& message, const std::string& advice) {
  return AllOf(Field(&Event::code, code), Field(&Event::severity, code.kind().severity),
               Field(&Event::message, HasSubstr(message)),
               Field(&Event::advice, HasSubstr(advice)));
}

template <typename Listing>
const Listing* listed_at(const std::vector<Listing>& all, const std::string& address) {
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const Listing& one) { return one.address == address; });
  return found == all.end() ? nullptr : &*found;
}

TEST(GigeNetwork, ACameraIsListedWithAllThatNamesIt) {
  VirtualCameraOptions options;
  options.user_name = "left";
  const VirtualStriper striper = small_striper(options);
  const std::vector<GigeListing> all = list_gige_cameras();
  const GigeListing* const one = listed_at(all, striper.options.address);
  ASSERT_NE(one, nullptr);
  EXPECT_EQ(one->uri, "gige:" + striper.options.serial);
  EXPECT_EQ(one->protocol, "GigE Vision");
  EXPECT_EQ(one->maker, "Striper");
  EXPECT_EQ(one->model, "VirtualStriper");
  EXPECT_EQ(one->serial, striper.options.serial);
  EXPECT_EQ(one->user_name, "left");
  EXPECT_THAT(one->mac, StartsWith("02:00:7f:"));
  EXPECT_EQ(one->interface, "lo");
  EXPECT_EQ(one->access, "free");
}

TEST(GigeNetwork, WhoHoldsACameraIsTold) {
  const VirtualStriper striper = small_striper();
  const auto source = striper.open();
  const std::vector<CameraListing> all = list_cameras();
  const CameraListing* const one = listed_at(all, striper.options.address);
  ASSERT_NE(one, nullptr);
  EXPECT_EQ(one->kind, "gige");
  EXPECT_EQ(one->serial, striper.options.serial);
  EXPECT_THAT(one->access, StartsWith("held by 127.0.0.1:"));
  EXPECT_EQ(one->trouble, one->access);
  EXPECT_THAT(one->other_uris, Contains("gige:" + striper.options.address));
}

TEST(GigeNetwork, AFreeCameraIsFound) {
  const VirtualStriper striper = small_striper();
  for (const std::string& name : {striper.options.address, striper.options.serial}) {
    const std::vector<Event> findings = examine_gige_network(name);
    EXPECT_LT(worst(findings), Severity::kError) << name;
    EXPECT_THAT(findings, Contains(finding("camera_found", "answers at", "")));
    EXPECT_THAT(findings, Contains(finding("camera_free", "free to be opened", "")));
  }
}

TEST(GigeNetwork, AHeldCameraIsBad) {
  const VirtualStriper striper = small_striper();
  const auto source = striper.open();
  const std::vector<Event> findings = examine_gige_network(striper.options.address);
  EXPECT_EQ(worst(findings), Severity::kError);
  EXPECT_THAT(findings,
              Contains(finding("camera_held", "held by another program (127.", "stop that")));
}

TEST(GigeNetwork, AnUnknownNameIsAnsweredWithThoseThatAreThere) {
  const VirtualStriper striper = small_striper();
  EXPECT_THAT(examine_gige_network("NOBODY"),
              Contains(finding("camera_not_found", "no camera 'NOBODY'; there are", "name one")));
  EXPECT_THAT(examine_gige_network("NOBODY"),
              Contains(finding("camera_not_found",
                               striper.options.serial + " at " + striper.options.address, "")));
}

TEST(GigeNetwork, PacketsThatAreTooLargeAreToldFromATriggerThatNeverComes) {
  VirtualCameraOptions options;
  options.mtu = 1500;
  const VirtualStriper striper = small_striper(options);
  EXPECT_THAT(
      examine_gige_stream(striper.options.address, 8000),
      Contains(finding("stream_blocked", "packets of 1400 bytes arrive, those of 8000 do not",
                       "packet_size=1400")));
  EXPECT_THAT(
      examine_gige_stream(striper.options.address, 1400),
      Contains(finding("camera_silent", "test packets arrive and frames do not", "trigger")));
  EXPECT_FALSE(striper.camera->statistics().is_controlled) << "control is given back";
}

TEST(GigeNetwork, PacketsThatNeverArriveAreToldFromACameraThatDoesNotAnswer) {
  VirtualCameraOptions options;
  options.mtu = 576;
  const VirtualStriper striper = small_striper(options);
  EXPECT_THAT(
      examine_gige_stream(striper.options.address, 1400),
      Contains(finding("stream_blocked", "packets of 576 bytes arrive", "packet_size=576")));
  striper.camera->set_stream_blocked(true);
  EXPECT_THAT(examine_gige_stream(striper.options.address, 1400),
              Contains(finding("stream_blocked", "none of its test packets arrives", "firewall")));
  EXPECT_TRUE(examine_gige_stream("NOBODY", 1400).empty());
}

}  // namespace
}  // namespace striper::testing
