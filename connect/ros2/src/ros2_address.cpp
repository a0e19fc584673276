// SPDX-License-Identifier: Apache-2.0
#include "ros2_address.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <string_view>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

constexpr long kMostDomain = 232;  // Its ports, from 7400 + 250 domain on, are below 65536.

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

[[noreturn]] void refuse(const std::string& what) { throw Error(ErrorKind::kUsage, what); }

std::uint32_t domain_of_environment() {
  const std::string text = variable("ROS_DOMAIN_ID");
  if (text.empty()) return 0;
  std::uint32_t domain = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), domain);
  if (error != std::errc() || end != text.data() + text.size() || domain > kMostDomain) {
    refuse(fmt::format("ROS_DOMAIN_ID is '{}' where 0 to {} is expected", text, kMostDomain));
  }
  return domain;
}

struct Choice {
  std::string interface;
  std::string from;
};

// As rmw_cyclonedds of Humble (ROS_LOCALHOST_ONLY) and of Iron and later
// (ROS_AUTOMATIC_DISCOVERY_RANGE) take them. Without a word a scanner talks to nobody outside.
Choice interface_of_environment() {
  const std::string localhost = variable("ROS_LOCALHOST_ONLY");
  if (!localhost.empty()) {
    return {localhost == "0" ? "auto" : "lo", "ROS_LOCALHOST_ONLY=" + localhost};
  }
  const std::string range = variable("ROS_AUTOMATIC_DISCOVERY_RANGE");
  if (range == "LOCALHOST") return {"lo", "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"};
  if (range == "SUBNET") return {"auto", "ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET"};
  if (range == "OFF") {
    refuse("ROS_AUTOMATIC_DISCOVERY_RANGE=OFF: nobody could find the topics; say interface=");
  }
  if (!variable("CYCLONEDDS_URI").empty()) return {"", "CYCLONEDDS_URI"};
  return {"lo", "the default"};
}

bool is_plain(std::string_view name) {
  return std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '@' || c == ':';
  });
}

Choice interface_of(Uri& uri) {
  const auto name = uri.take("interface");
  if (!name) return interface_of_environment();
  if (name->empty() || !is_plain(*name)) {
    refuse(fmt::format("sink '{}': interface is '{}' where lo, auto or a name is expected",
                       uri.text(), *name));
  }
  return {*name, "interface="};
}

template <typename T>
struct Word {
  std::string_view text;
  T value;
};

/// One of some words; the first where nothing is said.
template <typename T, std::size_t N>
T take_word(Uri& uri, const std::string& key, const std::array<Word<T>, N>& words) {
  const std::string text = uri.take(key).value_or(std::string(words.front().text));
  std::string expected;
  for (const Word<T>& word : words) {
    if (word.text == text) return word.value;
    expected += fmt::format("{}{}",
                            expected.empty()         ? ""
                            : &word == &words.back() ? " or "
                                                     : ", ",
                            word.text);
  }
  refuse(
      fmt::format("sink '{}': {} is '{}' where {} is expected", uri.text(), key, text, expected));
}

constexpr std::array<Word<bool>, 2> kReliable = {{{"reliable", true}, {"best_effort", false}}};
constexpr std::array<Word<RosNodeChoice>, 4> kNodes = {{{"off", RosNodeChoice::kOff},
                                                        {"humble", RosNodeChoice::kHumble},
                                                        {"iron", RosNodeChoice::kIron},
                                                        {"auto", RosNodeChoice::kAuto}}};

void require_prefix(const SinkUri& uri) {
  std::string_view rest = uri.path();
  while (!rest.empty()) {
    const std::size_t end = rest.find('/');
    if (!is_ros_name(rest.substr(0, end)) || end + 1 == rest.size()) {
      refuse(
          fmt::format("sink '{}': '{}' is no prefix of ROS 2 topics: words of letters, digits "
                      "and underscores, parted by '/'",
                      uri.text(), uri.path()));
    }
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  }
}

// On lo the others are asked one by one, since it need not have multicast: as many as ROS 2 asks.
constexpr std::string_view kLoopback =
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
    "<Peers><Peer address=\"localhost\"/></Peers></Discovery>";

// Some readers take no writer that leaves out what is the default: npm's @foxglove/rtps is one.
constexpr std::string_view kSpelledOut =
    "<Compatibility><ExplicitlyPublishQosSetToDefault>true</ExplicitlyPublishQosSetToDefault>"
    "</Compatibility>";

}  // namespace

bool is_ros_name(std::string_view word) noexcept {
  if (word.empty() || (word.front() >= '0' && word.front() <= '9')) return false;
  return std::all_of(word.begin(), word.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

Ros2Address Ros2Address::parse(SinkUri uri) {
  constexpr double kMostFrames_hz = 1e4;
  Ros2Address address;
  require_prefix(uri);
  address.prefix = uri.path();
  const auto domain = uri.take_integer("domain", 0, kMostDomain);
  address.domain = domain ? static_cast<std::uint32_t>(*domain) : domain_of_environment();
  address.is_reliable = take_word(uri, "qos", kReliable);
  address.frames_hz = uri.take_number("frames", 0.0, kMostFrames_hz).value_or(0.0);
  const std::string images = uri.take("images").value_or("raw");
  const std::optional<TopicImages> kind = topic_images_from_string(images);
  if (!kind) {
    refuse(fmt::format("sink '{}': images is '{}' where raw, compressed or both is expected",
                       uri.text(), images));
  }
  if (address.frames_hz > 0.0) address.images = *kind;
  address.node = take_word(uri, "node", kNodes);
  const Choice choice = interface_of(uri);
  address.interface = choice.interface;
  address.interface_from = choice.from;
  uri.refuse_unused("domain, qos, interface, frames, images, node");
  return address;
}

std::string Ros2Address::where() const {
  if (interface.empty()) return "the interface of CYCLONEDDS_URI";
  if (interface == "lo") return "lo, for this machine alone";
  if (interface == "auto") return "the interface that Cyclone DDS thinks best";
  return "interface " + interface;
}

std::string Ros2Address::configuration() const {
  if (interface.empty()) return variable("CYCLONEDDS_URI");
  const std::string which = interface == "auto" ? std::string("autodetermine=\"true\"")
                                                : fmt::format("name=\"{}\"", interface);
  return fmt::format(
      "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface {}/></Interfaces>"
      "</General>{}{}</Domain></CycloneDDS>",
      which, interface == "lo" ? kLoopback : "", kSpelledOut);
}

}  // namespace striper::detail
