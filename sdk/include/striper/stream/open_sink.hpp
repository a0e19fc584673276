// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <striper/stream/scan_sink.hpp>
#include <striper/stream/sink_uri.hpp>

namespace striper {

/// Makes a sink from its address: takes its keys and calls `refuse_unused`.
using SinkFactory = std::function<std::unique_ptr<ScanSink>(SinkUri uri)>;

/// Makes the sink that an address names:
///
///     csv:FILE?doubtful=yes&missing=yes   the agreed CSV; only `ok` returns unless said otherwise
///     jsonl:FILE                          a line of JSON per scan and event
///     mcap:FILE                           a recording of scans, status and events;
///                                         `?rotate=1GB|10min` goes on in run_0001.mcap, ...,
///                                         `?frames=HZ` adds so many frames a second
///     ply:FILE, pcd:FILE, las:FILE        points in the head's frame: `ok` returns, with
///                                         `?doubtful=yes` the doubtful too; moved between scans
///                                         along the scan frame's z with `?speed=M_PER_S`, or
///                                         `?odometer=FILE&counts_per_m=K&bits=8|16|32`
///     ros2:PREFIX                         topics for ROS 2 programs, /PREFIX/HEAD/points and so on
///                                         (docs/ros2.md); its library is loaded when it is named
///     web:PORT, web:ADDRESS:PORT          a page, Foxglove's WebSocket, status and metrics
///                                         (docs/foxglove.md); its library is loaded likewise
///     PATH                                whichever of these the extension says; `-` is CSV on the
///                                         standard output
///
/// Files are made when the first head opens: nothing gives way to nothing.
/// @throws Error{kUsage} for a wrong address, or a file that is there and holds something else;
/// {kUnsupported} where a sink's library is not installed.
std::unique_ptr<ScanSink> open_sink(std::string_view uri);
std::unique_ptr<ScanSink> open_sink(SinkUri uri);

/// Adds a kind of sink; the last of a scheme wins. Thread-safe.
/// @param scheme a word. @param extension of files that are of this kind, ".csv"; may be empty.
void register_sink(std::string scheme, SinkFactory factory, std::string extension = {});

/// The schemes that there are.
std::vector<std::string> sink_schemes();

}  // namespace striper
