// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <striper/stream/sink_plugin.hpp>

#include "web_sink.hpp"

extern "C" __attribute__((visibility("default"))) const striper::SinkPlugin striper_sink_plugin;

const striper::SinkPlugin striper_sink_plugin = {
    STRIPER_VERSION,
    [](striper::SinkUri uri) {
      return striper::detail::make_web_sink(striper::detail::WebAddress::parse(std::move(uri)));
    },
    [](striper::SinkUri uri, std::chrono::milliseconds /*watch*/) {
      striper::detail::WebAddress::parse(std::move(uri));
      return std::vector<striper::Event>();
    },
};
