// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>
#include <string_view>

#include <striper/core/log.hpp>

namespace striper::testing {

/// Everything that is logged while it lives, from whatever thread; one at a time.
class Told {
 public:
  Told() {
    set_log_callback([this](LogLevel, std::string_view message) {
      const std::lock_guard lock(mutex_);
      text_ += message;
      text_ += '\n';
    });
  }
  Told(const Told&) = delete;
  Told& operator=(const Told&) = delete;
  ~Told() { set_log_callback({}); }
  std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

}  // namespace striper::testing
