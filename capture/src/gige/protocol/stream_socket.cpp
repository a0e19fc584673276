// SPDX-License-Identifier: Apache-2.0
#include "gige/protocol/stream_socket.hpp"

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include <dirent.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace striper::detail {
namespace {

bool is_udp_at(int fd, int port) {
  int type = 0;
  socklen_t length = sizeof(type);
  if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_DGRAM) return false;
  sockaddr_in local{};
  length = sizeof(local);
  return getsockname(fd, reinterpret_cast<sockaddr*>(&local), &length) == 0 &&
         local.sin_family == AF_INET && ntohs(local.sin_port) == port;
}

int find_socket(int port) {
  DIR* const own = opendir("/proc/self/fd");
  if (own == nullptr) return -1;
  int found = -1;
  while (const dirent* const entry = readdir(own)) {
    const int fd = std::atoi(entry->d_name);
    if (fd > 2 && is_udp_at(fd, port)) found = fd;
  }
  closedir(own);
  return found;
}

}  // namespace

int set_receive_buffer(int port, int bytes) {
  const int fd = find_socket(port);
  if (fd < 0) return 0;
  if (bytes > 0) {
    // The kernel doubles what it is given, for its own overhead.
    const int half = bytes / 2;
    if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &half, sizeof(half)) != 0) {
      setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
    }
  }
  int in_force = 0;
  socklen_t length = sizeof(in_force);
  getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &in_force, &length);
  return in_force;
}

std::optional<std::uint64_t> receive_drops(int port) {
  // sl local_address rem_address st queues timer retrnsmt uid timeout inode ref pointer drops
  std::ifstream table("/proc/self/net/udp");
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    std::string slot;
    std::string local;
    fields >> slot >> local;
    const std::size_t colon = local.find(':');
    if (colon == std::string::npos) continue;
    if (std::strtol(local.c_str() + colon + 1, nullptr, 16) != port) continue;
    const std::size_t last = line.find_last_not_of(' ');
    const std::size_t before = line.find_last_of(' ', last);
    return std::strtoull(line.c_str() + before, nullptr, 10);
  }
  return std::nullopt;
}

}  // namespace striper::detail
