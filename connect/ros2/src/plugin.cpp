// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <striper/stream/sink_plugin.hpp>

#include "ros2_exam.hpp"
#include "ros2_sink.hpp"

extern "C" __attribute__((visibility("default"))) const striper::SinkPlugin striper_sink_plugin;

const striper::SinkPlugin striper_sink_plugin = {
    STRIPER_VERSION,
    [](striper::SinkUri uri) {
      return striper::detail::make_ros2_sink(striper::detail::Ros2Address::parse(std::move(uri)));
    },
    [](striper::SinkUri uri, std::chrono::milliseconds watch) {
      return striper::detail::examine_ros2(striper::detail::Ros2Address::parse(std::move(uri)),
                                           watch);
    },
};
