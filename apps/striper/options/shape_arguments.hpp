// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <striper/stream/shaped_sink.hpp>

#include "program/command.hpp"

namespace striper::program {

/// `--average`, `--smooth`, `--resample` and `--fill-gaps`.
struct ShapeArguments {
  int average = 1;
  std::string smooth = "off";
  std::optional<std::string> resample;
  std::optional<double> fill_gaps_m;

  /// @throws Error{kUsage} naming what makes no sense.
  ShapeOptions options() const;
};

void add_shape_arguments(Command& command, ShapeArguments& arguments);

}  // namespace striper::program
