// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string_view>

namespace striper {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

using LogCallback = std::function<void(LogLevel, std::string_view message)>;

/// Sends the library's messages to `callback` from now on; an empty callback silences them (the
/// default: the library itself never prints).
///
/// Thread-safe. The callback is called from whichever thread has something to say, one call at a
/// time, and must neither call `set_log_callback` nor anything of the library that logs.
void set_log_callback(LogCallback callback);

/// Hands one message to the callback, if there is one. Thread-safe.
void log(LogLevel level, std::string_view message);

}  // namespace striper
