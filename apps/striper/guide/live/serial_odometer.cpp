// SPDX-License-Identifier: Apache-2.0
// An odometer's counter at a serial line.
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <limits>
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

#include "guide/live/odometer_port.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view kScheme = "serial:";
constexpr std::size_t kLongestLine = 80;

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

bool read_reading(std::string_view line, OdometerReading& reading) {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  const char* const end = line.data() + line.size();
  const auto counts = std::from_chars(line.data(), end, reading.counts);
  reading.yaw_rate_rad_s = std::numeric_limits<double>::quiet_NaN();
  if (counts.ec != std::errc()) return false;
  if (counts.ptr == end) return true;
  if (*counts.ptr != ',') return false;
  const auto yaw = std::from_chars(counts.ptr + 1, end, reading.yaw_rate_rad_s);
  return yaw.ec == std::errc() && yaw.ptr == end;
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
      if (file_ < 0) file_ = open_line(device_, baud_);
      if (file_ < 0) {
        std::this_thread::sleep_for(1s);
        continue;
      }
      pollfd waits{file_, POLLIN, 0};
      constexpr int kWait_ms = 50;
      if (::poll(&waits, 1, kWait_ms) <= 0) continue;
      std::array<char, 256> bytes{};
      const ssize_t got = ::read(file_, bytes.data(), bytes.size());
      if (got > 0) {
        take(std::string_view(bytes.data(), static_cast<std::size_t>(got)));
      } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
        ::close(std::exchange(file_, -1));
      }
    }
  }

  void take(std::string_view bytes) {
    for (const char byte : bytes) {
      if (byte != '\n') {
        if (line_.size() < kLongestLine) line_ += byte;
        continue;
      }
      OdometerReading reading;
      if (read_reading(line_, reading)) {
        reading.time_s = seconds_since_1970();
        hearer_(reading);
      }
      line_.clear();
    }
  }

  std::string device_;
  speed_t baud_;
  OdometerHearer hearer_;
  int file_ = -1;
  std::string line_;
  std::jthread thread_;
};

}  // namespace

std::unique_ptr<OdometerPort> detail::open_serial_odometer(const std::string& address,
                                                           OdometerHearer hearer) {
  std::string device = address.substr(kScheme.size());
  int rate = 19200;  // The report's own line.
  if (const auto query = device.find("?baud="); query != std::string::npos) {
    const std::string text = device.substr(query + 6);
    std::from_chars(text.data(), text.data() + text.size(), rate);
    device.resize(query);
  }
  for (const Baud& baud : kBauds) {
    if (baud.rate == rate) {
      return std::make_unique<SerialOdometer>(std::move(device), baud.code, std::move(hearer));
    }
  }
  throw Error(ErrorKind::kBadValue,
              fmt::format("odometer '{}': baud {}; expected 9600 to 921600", address, rate));
}

}  // namespace striper::program
