// SPDX-License-Identifier: Apache-2.0
#include "ros2_exam.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <striper/core/error.hpp>

#include "multicast_exam.hpp"
#include "ros_graph.hpp"

namespace striper::detail {
namespace {

using Findings = std::vector<Event>;

// Programs of this machine claim their domain's port; beyond the first hundred domains it may be
// anybody's. Source: proc(5), /proc/net/udp.
std::set<std::uint32_t> domains_of_this_machine() {
  constexpr std::uint32_t kPlainDomains = 100;
  std::set<std::uint32_t> domains;
  std::ifstream table("/proc/net/udp");
  std::string line;
  while (std::getline(table, line)) {
    const std::size_t colon = line.find(':', line.find(':') + 1);  // "0: 00000000:1CE8 ..."
    if (colon == std::string::npos) continue;
    const unsigned long port = std::strtoul(line.c_str() + colon + 1, nullptr, 16);
    for (std::uint32_t domain = 0; domain <= kPlainDomains; ++domain) {
      if (port == discovery_port(domain)) domains.insert(domain);
    }
  }
  return domains;
}

void conclude_domains(std::uint32_t ours, Findings& findings) {
  std::set<std::uint32_t> others = domains_of_this_machine();
  others.erase(ours);
  if (others.empty()) return;
  findings.push_back({"other_domain",
                      fmt::format("programs of this machine are in domain {}, this is {}",
                                  fmt::join(others, ", "), ours),
                      "ROS_DOMAIN_ID must be the same for all, or ros2:?domain="});
}

// Fast DDS tries shared memory first, whose files other users cannot write.
void conclude_shared_memory(Findings& findings) {
  std::set<unsigned> users;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm", ignored)) {
    struct stat about {};
    const bool is_fast_dds = entry.path().filename().string().starts_with("fast");
    if (!is_fast_dds || ::stat(entry.path().c_str(), &about) != 0) continue;
    if (about.st_uid != ::geteuid()) users.insert(about.st_uid);
  }
  if (users.empty()) return;
  findings.push_back({"shared_memory_foreign",
                      fmt::format("Fast DDS programs of user {} use shared memory on this machine",
                                  fmt::join(users, ", ")),
                      "they hear Striper, which sends by UDP, but no Fast DDS program of another "
                      "user: run them as "
                      "one user, or without shared memory (FASTDDS_BUILTIN_TRANSPORTS=UDPv4)"});
}

// "rt/striper/points" is "/striper/points" to ROS 2, "sensor_msgs::msg::dds_::LaserScan_" its type.
std::string ros_name(const std::string& topic) {
  return topic.starts_with("rt/") ? topic.substr(2) : topic;
}

std::string ros_type(std::string type) {
  for (const auto& [from, to] : {std::pair("::dds_::", "/"), std::pair("::", "/")}) {
    for (std::size_t at = 0; (at = type.find(from, at)) != std::string::npos;) {
      type.replace(at, std::string_view(from).size(), to);
    }
  }
  if (type.ends_with('_')) type.pop_back();
  return type;
}

struct Topic {
  std::string type;
  int writers = 0;
  int readers = 0;
};

// Sensors' topics are one program's; /tf, /rosout and their like are everybody's.
bool is_one_programs(const Topic& topic) { return topic.type.starts_with("sensor_msgs/"); }

std::map<std::string, Topic> listen(const DdsParticipant& participant,
                                    std::chrono::milliseconds watch) {
  RosGraph writers(participant, RosGraph::Side::kWriters);
  RosGraph readers(participant, RosGraph::Side::kReaders);
  std::this_thread::sleep_for(watch);
  std::map<std::string, Topic> topics;
  const auto add = [&](RosGraph& graph, int Topic::*count) {
    for (const RosEndpoint& one : graph.take_new()) {
      Topic& topic = topics[ros_name(one.topic)];
      topic.type = ros_type(one.type);
      ++(topic.*count);
    }
  };
  add(writers, &Topic::writers);
  add(readers, &Topic::readers);
  return topics;
}

void conclude_topics(const std::map<std::string, Topic>& topics, const Ros2Address& address,
                     Findings& findings) {
  if (topics.empty()) {
    findings.push_back({"nobody_heard",
                        fmt::format("no ROS 2 program is heard in domain {}", address.domain),
                        "are they running, in this domain, on this interface (interface=NAME or "
                        "auto where they are on another machine)?"});
  }
  for (const auto& [name, topic] : topics) {
    findings.push_back({"topic_heard", fmt::format("{} ({}): {} writing, {} reading", name,
                                                   topic.type, topic.writers, topic.readers)});
    if (topic.writers < 2 || !is_one_programs(topic)) continue;
    findings.push_back({"name_taken", fmt::format("{} programs publish {}", topic.writers, name),
                        "give one of them another name: serve --name NAME, or ros2:PREFIX"});
  }
}

}  // namespace

std::vector<Event> examine_ros2(const Ros2Address& address, std::chrono::milliseconds watch) {
  Findings findings;
  const bool is_named = !address.interface.empty() && address.interface != "auto";
  if (is_named) findings = examine_interface(address.interface, address.domain);
  if (!findings.empty()) return findings;
  conclude_domains(address.domain, findings);
  conclude_shared_memory(findings);
  try {
    const DdsParticipant participant(address);
    findings.push_back(
        {"topics_offered", fmt::format("ROS 2 domain {} on {} (by {})", address.domain,
                                       address.where(), address.interface_from)});
    conclude_topics(listen(participant, watch), address, findings);
  } catch (const Error& error) {
    findings.push_back({"interface_unfit", error.what()});
  }
  return findings;
}

}  // namespace striper::detail
