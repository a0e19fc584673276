// SPDX-License-Identifier: Apache-2.0
// An odometer's counter at a serial line.
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/core/uri.hpp>

#include "guide/live/odometer_lines.hpp"
#include "guide/live/odometer_port.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view kScheme = "serial:";
constexpr auto kLook = 50ms;         // How often it looks whether it is to end.
constexpr auto kOpenEvery = 1000ms;  // A device that has gone away.

struct Baud {
  int rate;
  speed_t code;
};
constexpr std::array kBauds{Baud{9600, B9600},     Baud{19200, B19200},   Baud{38400, B38400},
                            Baud{57600, B57600},   Baud{115200, B115200}, Baud{230400, B230400},
                            Baud{460800, B460800}, Baud{921600, B921600}};

double seconds_since_1970() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

// A line of eight bits without parity, as bytes.
int open_line(const std::string& device, speed_t baud) {
  const int file = ::open(device.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return -1;
  termios line{};
  if (::tcgetattr(file, &line) == 0) {
    ::cfmakeraw(&line);
    ::cfsetispeed(&line, baud);
    ::cfsetospeed(&line, baud);
    line.c_cflag |= CLOCAL | CREAD;
    ::tcsetattr(file, TCSANOW, &line);
    ::tcflush(file, TCIFLUSH);
  }
  return file;
}

class SerialOdometer : public OdometerPort {
 public:
  SerialOdometer(std::string device, speed_t baud, OdometerHearer hearer)
      : device_(std::move(device)), baud_(baud), hearer_(std::move(hearer)) {
    file_ = open_line(device_, baud_);
    if (file_ < 0) {
      throw Error(ErrorKind::kDevice,
                  fmt::format("odometer {}: {}", device_, std::generic_category().message(errno)));
    }
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~SerialOdometer() override {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    if (file_ >= 0) ::close(file_);
  }

 private:
  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (file_ < 0) {
        wait(stop, kOpenEvery);
        file_ = open_line(device_, baud_);
        lines_.begin_anew();
        continue;
      }
      pollfd waits{file_, POLLIN, 0};
      if (::poll(&waits, 1, static_cast<int>(kLook.count())) <= 0) continue;
      std::array<char, 256> bytes{};
      const ssize_t got = ::read(file_, bytes.data(), bytes.size());
      if (got > 0) {
        take(std::string_view(bytes.data(), static_cast<std::size_t>(got)));
      } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
        ::close(std::exchange(file_, -1));
      }
    }
  }

  static void wait(const std::stop_token& stop, std::chrono::milliseconds how_long) {
    const auto until = std::chrono::steady_clock::now() + how_long;
    while (!stop.stop_requested() && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(kLook);
    }
  }

  void take(std::string_view bytes) {
    for (const char byte : bytes) {
      if (auto reading = lines_.take(byte)) {
        reading->time_s = seconds_since_1970();
        hearer_(*reading);
      }
    }
  }

  std::string device_;
  speed_t baud_;
  OdometerHearer hearer_;
  int file_ = -1;
  OdometerLines lines_;
  std::jthread thread_;
};

}  // namespace

std::unique_ptr<OdometerPort> detail::open_serial_odometer(const std::string& address,
                                                           OdometerHearer hearer) {
  std::string device = address.substr(kScheme.size());
  int rate = 19200;  // The report's own line.
  if (const auto query = device.find("?baud="); query != std::string::npos) {
    const std::string text = device.substr(query + 6);
    const char* const last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), last, rate);
    if (error != std::errc() || end != last) rate = 0;  // None of those below.
    device.resize(query);
  }
  for (const Baud& baud : kBauds) {
    if (baud.rate == rate) {
      return std::make_unique<SerialOdometer>(std::move(device), baud.code, std::move(hearer));
    }
  }
  throw Error(ErrorKind::kBadValue,
              fmt::format("odometer '{}' - expected baud=9600, 19200, 38400, ... 921600", address));
}

}  // namespace striper::program
