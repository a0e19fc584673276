// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <striper/stream/scan_bus.hpp>
#include <striper/stream/shaped_sink.hpp>
#include <striper/stream/sink_uri.hpp>

#include "run/summary.hpp"

namespace striper::program {

/// The sinks of a command that may shape scans on the way (--average, --smooth, --resample), and
/// what came out of that, which is not what went in.
class ShapedOutputs {
 public:
  /// Opens them and adds them to the bus. @throws as `open_sink` and `ShapeOptions::validate`.
  ShapedOutputs(const std::vector<SinkUri>& uris, const ShapeOptions& shape, ScanBus& bus);

  bool are_shaped() const noexcept { return !counts_.empty(); }

  /// The bus's, whose `written` are here the scans that came out. After it finished.
  std::vector<SinkReport> reports(const ScanBus& bus) const;

  /// Returns of the scans that came out, of the first output.
  ReturnCounts returns() const;

  /// Says what came out, where anything was asked for.
  void say_result() const;
  /// `{scans, incomplete, moved, returns}`; null where nothing was asked for.
  nlohmann::json to_json() const;

  /// Whether most returns were refused because they moved: then the sensor, or all that it sees,
  /// does not stand still.
  bool has_moved() const noexcept;

 private:
  std::vector<std::shared_ptr<ShapeCounts>> counts_;  // One an output; none where nothing is asked.
};

}  // namespace striper::program
