// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string_view>
#include <vector>

#include <striper/core/event.hpp>
#include <striper/stream/scan_sink.hpp>
#include <striper/stream/sink_uri.hpp>

namespace striper {

/// What the library of a sink that is loaded when it is named exports, in C's way and under the
/// name `striper_sink_plugin`. It is `libstriper-SCHEME.so`, beside the program's other libraries
/// or wherever the loader looks, and stays loaded.
struct SinkPlugin {
  const char* version;  ///< That it was built with: another one is refused.
  std::unique_ptr<ScanSink> (*make)(SinkUri uri);
  std::vector<Event> (*examine)(SinkUri uri, std::chrono::milliseconds watch);
};

/// What is in the way of a sink, and what its network shows, for people who look for a fault.
/// @param uri of a sink that is a plug-in. @param watch how long to listen.
/// @throws Error{kUsage} for a wrong address, {kUnsupported} where the library is not installed.
std::vector<Event> examine_sink(std::string_view uri, std::chrono::milliseconds watch);

}  // namespace striper
