// SPDX-License-Identifier: Apache-2.0
// Proves that an action command triggers, all at once, the cameras that were opened with its keys
// and no others. The virtual camera answers it as GigE Vision 2.0, 14.3 has it; how much apart the
// exposures of real cameras begin is their makers' business.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/gige/gige_network.hpp>

#include "capture/gige/virtual_striper.hpp"
#include "gige/protocol/gvcp.hpp"
#include "gige/protocol/gvcp_client.hpp"
#include "gige/protocol/udp_socket.hpp"
#include "support/heard.hpp"

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

/// The numbers of the frames that come: of so many, and of any that should not.
Numbers frames_of(FrameSource& source, std::size_t expected) {
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
  EXPECT_EQ(frames_of(*left_source, 1), Numbers({0}));
  EXPECT_EQ(frames_of(*right_source, 1), Numbers({0}));

  EXPECT_EQ(trigger_gige_action(own_keys(2), 1, 3000ms), 1);
  EXPECT_EQ(frames_of(*left_source, 0), Numbers());
  EXPECT_EQ(frames_of(*right_source, 1), Numbers({1}));
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
  EXPECT_EQ(frames_of(*source, 0), Numbers());
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
  detail::CameraFaults faults;
  faults.lacking = {"ActionSelector"};
  const VirtualStriper striper(std::make_shared<PatternScene>(cv::Size(64, 48), 8, 200.0), {},
                               faults);
  const auto source = started(striper, own_keys(1));
  EXPECT_EQ(trigger_gige_action(own_keys(1), 1, 3000ms), 1);
  EXPECT_EQ(frames_of(*source, 1), Numbers({0}));
}

TEST(GigeAction, OnTheCamerasOwnKeysIsWarnedOf) {
  const VirtualStriper striper = still_camera();
  const Heard heard;
  { const auto source = striper.open("trigger=Action", heard.port()); }
  EXPECT_THAT(heard.events(), has_event("setting_unlikely"));
}

/// Answers every action command with our keys from each of its addresses, twice.
class Echo {
 public:
  Echo(ActionKeys keys, const std::vector<std::string>& addresses) : keys_(keys) {
    ears_ = bound("255.255.255.255", detail::gvcp::kPort);
    for (const std::string& address : addresses) mouths_.push_back(bound(address, 0));
    thread_ = std::thread([this] { run(); });
  }
  ~Echo() {
    is_ending_ = true;
    thread_.join();
    close(ears_);
    for (const int mouth : mouths_) close(mouth);
  }

 private:
  static int bound(const std::string& address, std::uint16_t port) {
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const int yes = 1;
    const timeval patience{0, 20'000};
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    std::uint32_t number = 0;
    EXPECT_TRUE(detail::gvcp::parse_ip(address, number));
    const sockaddr_in local = detail::socket_address(number, port);
    EXPECT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&local), sizeof(local)), 0) << address;
    return fd;
  }

  void run() {
    std::array<std::uint8_t, 64> packet{};
    while (!is_ending_) {
      sockaddr_in from{};
      socklen_t length = sizeof(from);
      const ssize_t size = recvfrom(ears_, packet.data(), packet.size(), 0,
                                    reinterpret_cast<sockaddr*>(&from), &length);
      const bool is_ours = size >= 20 && detail::gvcp::get16(&packet[2]) == detail::gvcp::kAction &&
                           detail::gvcp::get32(&packet[8]) == keys_.device_key;
      if (!is_ours) continue;
      std::array<std::uint8_t, 8> answer{};
      detail::gvcp::put16(&answer[2], detail::gvcp::kAction + 1U);
      std::copy_n(&packet[6], 2, &answer[6]);
      for (int n = 0; n < 2; ++n) {
        for (const int mouth : mouths_) {
          sendto(mouth, answer.data(), answer.size(), 0, reinterpret_cast<const sockaddr*>(&from),
                 sizeof(from));
        }
      }
    }
  }

  ActionKeys keys_;
  int ears_ = -1;
  std::vector<int> mouths_;
  std::atomic<bool> is_ending_ = false;
  std::thread thread_;
};

TEST(GigeAction, CountsACameraThatAnswersTwiceOnce) {
  const Echo one(own_keys(1), {own_address()});
  EXPECT_EQ(trigger_gige_action(own_keys(1), 2, 500ms), 1);
  ActionKeys others = own_keys(1);
  others.device_key ^= 0x40000000U;
  const Echo two(others, {own_address(), own_address()});
  EXPECT_EQ(trigger_gige_action(others, 2, 3000ms), 2);
}

TEST(GigeAction, IsSentOnceToEachSubnet) {
  const detail::NetworkInterface left{"eth0", 0x0a000001, 0xffffff00, 1500};
  const detail::NetworkInterface again{"eth1", 0x0a000002, 0xffffff00, 1500};
  const detail::NetworkInterface right{"eth2", 0x0a000101, 0xffffff00, 1500};
  std::vector<std::string> names;
  for (const auto& one : detail::one_of_each_subnet({left, again, right})) {
    names.push_back(one.name);
  }
  EXPECT_EQ(names, std::vector<std::string>({"eth0", "eth2"}));
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
