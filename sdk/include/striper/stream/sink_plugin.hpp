// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <striper/stream/scan_sink.hpp>
#include <striper/stream/sink_uri.hpp>

namespace striper {

/// What the library of a sink that is loaded when it is named exports, in C's way and under the
/// name `striper_sink_plugin`. It is `libstriper-SCHEME.so`, beside the program's other libraries
/// or wherever the loader looks, and stays loaded.
struct SinkPlugin {
  const char* version;  ///< That it was built with: another one is refused.
  std::unique_ptr<ScanSink> (*make)(SinkUri uri);
};

}  // namespace striper
