// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <striper/can/can_listener.hpp>
#include <striper/core/error.hpp>

#include "can_socket.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kLargestShortId = 0x7FF;
constexpr double kLongestLog_s = 1e9;  // What a clock of nanoseconds holds, and no log has.

double seconds_since_1970() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

// Hears the frames that are wanted, stamped by the kernel.
class SocketListener : public CanListener {
 public:
  SocketListener(const std::string& interface, const std::vector<std::uint32_t>& ids)
      : socket_(interface) {
    std::vector<can_filter> filters;
    for (const std::uint32_t id : ids) {
      const canid_t form = id > kLargestShortId ? CAN_EFF_FLAG : 0;
      filters.push_back(
          {id | form, CAN_EFF_FLAG | CAN_RTR_FLAG | (form != 0 ? CAN_EFF_MASK : CAN_SFF_MASK)});
    }
    ::setsockopt(socket_.get(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                 static_cast<socklen_t>(filters.size() * sizeof(can_filter)));
    const int yes = 1;
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_TIMESTAMP, &yes, sizeof yes);
  }

  bool next(HeardFrame& heard, std::chrono::milliseconds timeout) override {
    pollfd waits{socket_.get(), POLLIN, 0};
    if (::poll(&waits, 1, static_cast<int>(timeout.count())) <= 0) return false;
    can_frame raw{};
    iovec part{&raw, sizeof raw};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timeval))> control{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    if (::recvmsg(socket_.get(), &message, 0) != static_cast<ssize_t>(sizeof raw)) {
      std::this_thread::sleep_for(std::min(timeout, 10ms));  // Down: an error is ready at once.
      return false;
    }
    heard.time_s = time_of(message);
    heard.frame.id = raw.can_id & CAN_EFF_MASK;
    heard.frame.size = std::min<std::uint8_t>(raw.can_dlc, CAN_MAX_DLEN);
    std::memcpy(heard.frame.data.data(), raw.data, heard.frame.size);
    return true;
  }

 private:
  static double time_of(msghdr& message) {
    for (cmsghdr* one = CMSG_FIRSTHDR(&message); one != nullptr; one = CMSG_NXTHDR(&message, one)) {
      if (one->cmsg_level != SOL_SOCKET || one->cmsg_type != SCM_TIMESTAMP) continue;
      timeval stamp{};
      std::memcpy(&stamp, CMSG_DATA(one), sizeof stamp);
      return static_cast<double>(stamp.tv_sec) + 1e-6 * static_cast<double>(stamp.tv_usec);
    }
    return seconds_since_1970();
  }

  detail::CanSocketHandle socket_;
};

// Plays a log as if it happened now: its first frame when it is first asked for.
class LogListener : public CanListener {
 public:
  LogListener(std::string path, std::vector<std::uint32_t> ids)
      : path_(std::move(path)), ids_(std::move(ids)) {
    // A pipe would hold up whoever opens it.
    if (std::error_code ignored; std::filesystem::exists(path_, ignored) &&
                                 !std::filesystem::is_regular_file(path_, ignored)) {
      throw Error(ErrorKind::kUnsupported,
                  fmt::format("candump:{} is no file - expected a log of candump -L; a bus is "
                              "can:INTERFACE",
                              path_));
    }
    file_.open(path_);
    if (!file_) {
      throw Error(ErrorKind::kNotFound, fmt::format("candump:{}: there is no such log", path_));
    }
    read_next();
  }

  bool next(HeardFrame& heard, std::chrono::milliseconds timeout) override {
    if (is_over_) {
      std::this_thread::sleep_for(timeout);
      return false;
    }
    if (!has_begun_) {
      begin_ = Clock::now();
      first_s_ = next_.time_s;
      has_begun_ = true;
    }
    const auto due =
        begin_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                     std::clamp(next_.time_s - first_s_, 0.0, kLongestLog_s)));
    const auto until = Clock::now() + timeout;
    std::this_thread::sleep_until(std::min(due, until));
    if (due > until) return false;
    heard = next_;
    heard.time_s = seconds_since_1970();
    read_next();
    return true;
  }
  bool is_over() const noexcept override { return is_over_; }

 private:
  void read_next() {
    std::string line;
    while (std::getline(file_, line)) {
      ++line_;
      if (line.empty()) continue;
      if (line.front() != '(') {
        throw Error(ErrorKind::kBadFile,
                    fmt::format("candump:{}:{}: '{}' - expected (SECONDS) INTERFACE ID#DATA, as "
                                "candump -L writes it",
                                path_, line_, line.substr(0, 40)));
      }
      if (!read_candump_line(line, next_)) continue;
      if (std::find(ids_.begin(), ids_.end(), next_.frame.id) != ids_.end()) return;
    }
    is_over_ = true;
  }

  std::string path_;
  std::vector<std::uint32_t> ids_;
  std::ifstream file_;
  int line_ = 0;
  HeardFrame next_;
  bool is_over_ = false;
  bool has_begun_ = false;
  Clock::time_point begin_;
  double first_s_ = 0.0;
};

// The next word of a line; the line goes on after it.
std::string_view take_word(std::string_view& line) {
  const std::size_t from = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t to = std::min(line.find(' ', from), line.size());
  const std::string_view word = line.substr(from, to - from);
  line.remove_prefix(to);
  return word;
}

template <typename Number>
bool read_hex(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, 16);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

bool read_candump_line(std::string_view line, HeardFrame& heard) noexcept {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  const std::string_view time = take_word(line);
  take_word(line);
  const std::string_view frame = take_word(line);
  const std::size_t sign = frame.find('#');
  if (time.size() < 3 || time.front() != '(' || time.back() != ')' ||
      sign == std::string_view::npos) {
    return false;
  }
  const auto [end, error] =
      std::from_chars(time.data() + 1, time.data() + time.size() - 1, heard.time_s);
  if (error != std::errc() || end != time.data() + time.size() - 1 ||
      !std::isfinite(heard.time_s)) {
    return false;
  }
  const std::string_view data = frame.substr(sign + 1);
  heard.frame = {};
  if (!read_hex(frame.substr(0, sign), heard.frame.id) || heard.frame.id > CAN_EFF_MASK) {
    return false;
  }
  if (data.size() % 2 != 0 || data.size() > 2 * heard.frame.data.size()) return false;
  for (std::size_t i = 0; 2 * i < data.size(); ++i) {
    if (!read_hex(data.substr(2 * i, 2), heard.frame.data[i])) return false;
  }
  heard.frame.size = static_cast<std::uint8_t>(data.size() / 2);
  return true;
}

// NOLINTNEXTLINE(performance-unnecessary-value-param): as all that open an address.
std::unique_ptr<CanListener> open_can_listener(CanUri uri, const std::vector<std::uint32_t>& ids) {
  uri.refuse_unused("id, start, size, order");
  if (uri.scheme() == "can") return std::make_unique<SocketListener>(uri.path(), ids);
  return std::make_unique<LogListener>(uri.path(), ids);
}

}  // namespace striper
