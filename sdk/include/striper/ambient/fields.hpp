// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <striper/core/frame.hpp>

namespace striper {

/// Takes an interlaced frame apart into its two fields, the earlier one first.
///
/// No pixel is copied: the fields are views of every other row. Each has its own grid (step 2 along
/// v), its own time (half a frame apart) and its place in the frame's exposures. Precondition:
/// `frame.is_interlaced()`. Thread-safe.
std::array<Frame, 2> split_fields(const Frame& frame);

/// Calls with each exposure of a frame in order of time: the frame itself, or the fields of an
/// interlaced frame. One of a single row has a top field only.
template <typename Action>
void for_each_exposure(const Frame& frame, const Action& action) {
  if (!frame.is_interlaced()) {
    action(frame);
    return;
  }
  for (const Frame& field : split_fields(frame)) {
    if (!field.image.empty()) action(field);
  }
}

}  // namespace striper
