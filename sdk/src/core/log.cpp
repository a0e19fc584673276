// SPDX-License-Identifier: Apache-2.0
#include <mutex>
#include <utility>

#include <striper/core/log.hpp>

namespace striper {
namespace {

struct LogSink {
  std::mutex mutex;
  LogCallback callback;
};

LogSink& log_sink() {
  static LogSink sink;
  return sink;
}

}  // namespace

void set_log_callback(LogCallback callback) {
  LogSink& sink = log_sink();
  const std::lock_guard lock(sink.mutex);
  sink.callback = std::move(callback);
}

void log(LogLevel level, std::string_view message) {
  LogSink& sink = log_sink();
  const std::lock_guard lock(sink.mutex);
  if (sink.callback) sink.callback(level, message);
}

}  // namespace striper
