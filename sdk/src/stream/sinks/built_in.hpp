// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <striper/stream/scan_sink.hpp>
#include <striper/stream/sink_uri.hpp>

namespace striper::detail {

// The sinks that come with the sdk, each in a file of its name: how to make one from its address.
std::unique_ptr<ScanSink> make_csv_sink(SinkUri uri);
std::unique_ptr<ScanSink> make_jsonl_sink(SinkUri uri);
std::unique_ptr<ScanSink> make_mcap_sink(SinkUri uri);
std::unique_ptr<ScanSink> make_point_sink(SinkUri uri);   // ply:, pcd:, las:
std::unique_ptr<ScanSink> make_plugin_sink(SinkUri uri);  // ros2:

}  // namespace striper::detail
