// SPDX-License-Identifier: Apache-2.0
#include "gige/protocol/reverse_path.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

namespace striper::detail {
namespace {

int setting(const std::string& interface) {
  std::ifstream file("/proc/sys/net/ipv4/conf/" + interface + "/rp_filter");
  int value = 0;
  file >> value;
  return value;
}

}  // namespace

bool filters_by_reverse_path(const std::string& interface) {
  return std::max(setting("all"), setting(interface)) == 1;  // the kernel takes the larger one
}

std::uint64_t reverse_path_drops() {
  // Pairs of lines: "TcpExt: name name ..." and "TcpExt: number number ...".
  std::ifstream table("/proc/self/net/netstat");
  std::string names;
  std::string numbers;
  while (std::getline(table, names) && std::getline(table, numbers)) {
    std::istringstream name(names);
    std::istringstream number(numbers);
    std::string word;
    std::string value;
    while (name >> word && number >> value) {
      if (word == "IPReversePathFilter") return std::stoull(value);
    }
  }
  return 0;
}

}  // namespace striper::detail
