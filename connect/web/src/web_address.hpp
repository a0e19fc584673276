// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <striper/stream/scan_topics.hpp>
#include <striper/stream/sink_uri.hpp>

namespace striper::detail {

/// `web:[ADDRESS:]PORT[?frames=HZ&images=raw|compressed|both&origin=URL]`.
struct WebAddress {
  std::string address = "127.0.0.1";  ///< Of the interface: IPv4, or IPv6 without brackets.
  std::uint16_t port = 0;             ///< 0: any that is free.
  double frames_hz = 10.0;            ///< Images of each head, made where wanted; 0: none.
  TopicImages images = TopicImages::kBoth;
  std::vector<std::string> origins;  ///< Pages of other servers that may read, too.

  /// @throws Error{kUsage} quoting what is wrong.
  static WebAddress parse(SinkUri uri);
};

}  // namespace striper::detail
