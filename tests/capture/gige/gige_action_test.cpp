// SPDX-License-Identifier: Apache-2.0
// Proves that an action command triggers, all at once, the cameras that were opened with its keys
// and no others. The virtual camera answers it as GigE Vision 2.0, 14.3 has it; how much apart the
// exposures of real cameras begin is their makers' business.
#include <chrono>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/core/log.hpp>
#include <striper/gige/gige_network.hpp>

#include "capture/gige/virtual_striper.hpp"
#include "gige/gvcp.hpp"
#include "gige/gvcp_client.hpp"

namespace striper::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

// Other test programs run beside this one, and a broadcast reaches all of this machine.
ActionKeys own_keys(std::uint32_t mask) {
  return {0xc0ffee00U + static_cast<std::uint32_t>(getpid()), 7, mask};
}

VirtualStriper still_camera() {
  return VirtualStriper(std::make_shared<PatternScene>(cv::Size(64, 48), 8, 200.0));
}

std::unique_ptr<GigeSource> started(const VirtualStriper& striper, const ActionKeys& keys,
                                    const std::string& trigger = "Action") {
  auto source = striper.open(fmt::format("trigger={}&action=0x{:x},{},{}", trigger, keys.device_key,
                                         keys.group_key, keys.group_mask));
  source->start();
  return source;
}

using Numbers = std::vector<std::uint64_t>;

/// The numbers of the pictures that come: of so many, and of any that should not.
Numbers pictures_of(FrameSource& source, std::size_t expected) {
  Numbers numbers;
  Frame frame;
  while (source.next(frame, numbers.size() < expected ? 3000ms : 200ms) == NextStatus::kFrame) {
    numbers.push_back(frame.sequence);
  }
  return numbers;
}

TEST(GigeAction, TriggersTheCamerasOfItsGroupAtOnce) {
  const VirtualStriper left = still_camera();
  const VirtualStriper right = still_camera();
  const auto left_source = started(left, own_keys(1));
  const auto right_source = started(right, own_keys(2), "Action1");

  EXPECT_EQ(trigger_gige_action(own_keys(3), 2, 3000ms), 2);
  EXPECT_EQ(pictures_of(*left_source, 1), Numbers({0}));
  EXPECT_EQ(pictures_of(*right_source, 1), Numbers({0}));

  EXPECT_EQ(trigger_gige_action(own_keys(2), 1, 3000ms), 1);
  EXPECT_EQ(pictures_of(*left_source, 0), Numbers());
  EXPECT_EQ(pictures_of(*right_source, 1), Numbers({1}));
}

TEST(GigeAction, WithOtherKeysDoesNothing) {
  const VirtualStriper striper = still_camera();
  const auto source = started(striper, own_keys(1));
  ActionKeys other_device = own_keys(1);
  other_device.device_key ^= 0x80000000U;
  ActionKeys other_group = own_keys(1);
  ++other_group.group_key;
  for (const ActionKeys& keys : {other_device, other_group, own_keys(0xfffffffeU)}) {
    EXPECT_EQ(trigger_gige_action(keys), 0);
  }
  EXPECT_EQ(pictures_of(*source, 0), Numbers());
}

TEST(GigeAction, DoesNothingToACameraThatNobodyControls) {
  const VirtualStriper striper = still_camera();
  started(striper, own_keys(1));
  EXPECT_FALSE(striper.camera->statistics().is_controlled);
  EXPECT_EQ(trigger_gige_action(own_keys(1)), 0);
}

TEST(GigeAction, IsTheOneThatTheTriggerNames) {
  const VirtualStriper striper = still_camera();
  const auto source = started(striper, own_keys(1), "Action1");
  std::vector<std::uint32_t> selected;
  for (const RegisterWrite& write : striper.camera->register_writes()) {
    if (write.name == "ActionSelector") selected.push_back(write.value);
  }
  EXPECT_EQ(selected, std::vector<std::uint32_t>({1}));
}

TEST(GigeAction, NeedsNoSelectorInACameraThatHasOneAction) {
  VirtualCameraOptions options;
  options.lacking = {"ActionSelector"};
  const VirtualStriper striper(std::make_shared<PatternScene>(cv::Size(64, 48), 8, 200.0), options);
  const auto source = started(striper, own_keys(1));
  EXPECT_EQ(trigger_gige_action(own_keys(1), 1, 3000ms), 1);
  EXPECT_EQ(pictures_of(*source, 1), Numbers({0}));
}

TEST(GigeAction, OnTheCamerasOwnKeysIsWarnedOf) {
  const VirtualStriper striper = still_camera();
  std::string told;
  set_log_callback([&](LogLevel, std::string_view message) { told += message; });
  { const auto source = striper.open("trigger=Action"); }
  set_log_callback(nullptr);
  EXPECT_THAT(told, HasSubstr("trigger=Action without action="));
}

TEST(GigeAction, KeyIsNotForEverybodyToRead) {
  const VirtualStriper striper = still_camera();
  const auto source = started(striper, own_keys(1));
  std::uint32_t address = 0;
  ASSERT_TRUE(detail::gvcp::parse_ip(striper.options.address, address));
  EXPECT_FALSE(detail::read_register(address, detail::gvcp::kActionDeviceKey, 500ms).has_value());
  EXPECT_EQ(detail::read_register(address, detail::gvcp::kActionGroupKey, 500ms), 7U);
}

}  // namespace
}  // namespace striper::testing
