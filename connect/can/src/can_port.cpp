// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cmath>
#include <cstring>
#include <iterator>

#include <fmt/format.h>
#include <linux/can.h>
#include <unistd.h>

#include <striper/can/can_port.hpp>
#include <striper/core/append_file.hpp>
#include <striper/core/error.hpp>

#include "can_socket.hpp"

namespace striper {
namespace {

constexpr std::string_view kBus = "can";
constexpr std::string_view kLog = "candump";
constexpr const char* kNameInLogs = "can0";

// Sends to one interface and hears nothing.
class CanSocket : public CanPort {
 public:
  explicit CanSocket(const std::string& interface) : socket_(interface) {}

  void send(double /*time_s*/, const CanFrame& frame) noexcept override {
    can_frame raw{};
    raw.can_id = frame.id;
    raw.can_dlc = frame.size;
    std::memcpy(raw.data, frame.data.data(), frame.size);
    count(::write(socket_.get(), &raw, sizeof raw) == sizeof raw ? 0 : errno);
  }

  void close() override {}

 private:
  detail::CanSocketHandle socket_;
};

class CandumpFile : public CanPort {
 public:
  explicit CandumpFile(const std::string& path) : file_(path) {}

  void send(double time_s, const CanFrame& frame) noexcept override {
    constexpr std::size_t kEnough = 1 << 14;
    append_candump_line(file_.lines(), time_s, frame);
    if (file_.lines().size() > kEnough) flush();
    count(0);
  }

  void close() override {
    if (failure_) std::rethrow_exception(failure_);
    file_.close();
  }

 private:
  void flush() noexcept {
    try {
      file_.flush();
    } catch (...) {
      failure_ = std::current_exception();
    }
  }

  AppendFile file_;
  std::exception_ptr failure_;
};

}  // namespace

bool CanUri::is_one(std::string_view text) noexcept {
  const std::string_view word = scheme_word(text);
  return word == kBus || word == kLog;
}

CanUri CanUri::parse(std::string_view text) {
  CanUri uri("output", text);
  const std::string_view address = uri.address();
  uri.scheme_ = scheme_word(address);
  uri.path_ = is_one(address) ? address.substr(uri.scheme_.size() + 1) : "";
  if (uri.path_.empty()) {
    throw Error(ErrorKind::kUsage,
                fmt::format("output '{}' - expected can:INTERFACE or candump:FILE", text));
  }
  return uri;
}

void CanPort::count(int error) noexcept {
  (error == 0 ? sent_ : lost_) += 1;
  if (error != 0) last_error_ = error;
}

// NOLINTNEXTLINE(performance-unnecessary-value-param): as all that open an address.
std::unique_ptr<CanPort> open_can_port(CanUri uri) {
  uri.refuse_unused("id");
  if (uri.scheme() == kBus) return std::make_unique<CanSocket>(uri.path());
  return std::make_unique<CandumpFile>(uri.path());
}

void append_candump_line(std::string& out, double time_s, const CanFrame& frame) {
  const double whole_us = std::round(time_s * 1e6);
  fmt::format_to(std::back_inserter(out), "({:.6f}) {} {:03X}#", whole_us * 1e-6, kNameInLogs,
                 frame.id);
  for (std::size_t i = 0; i < frame.size; ++i) {
    fmt::format_to(std::back_inserter(out), "{:02X}", frame.data[i]);
  }
  out += '\n';
}

}  // namespace striper
