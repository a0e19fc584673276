// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <striper/stream/head.hpp>
#include <striper/stream/scan_bus.hpp>

namespace striper {

/// A head, as who serves it knows it.
struct ServedHead {
  std::string name;
  std::string source;  ///< As it was named.
  std::string model;   ///< Its file; empty without one.
  HeadHealth health;
};

/// What a sink may ask of the program that it works for, for people who ask the sink. Thread-safe;
/// to be asked until the sink's `finish` returns. Empty where the program does not tell.
struct SinkServices {
  std::function<std::vector<ServedHead>()> heads;
  std::function<std::vector<SinkReport>()> sinks;
};

}  // namespace striper
