// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include <striper/capture/source_uri.hpp>
#include <striper/core/frame_source.hpp>

namespace striper::detail {

/// The keys that every source knows: `laser=` and `fields=` (open_source.hpp says what they mean).
struct CommonKeys {
  /// For SourceUri::refuse_unused.
  static constexpr std::string_view kKnown = "laser, fields";

  IlluminationPattern pattern;  ///< Automatic unless `laser=` says otherwise.
  std::optional<Field> fields;  ///< kInterlacedTopFirst or kInterlacedBottomFirst, if given.

  /// @throws Error{kUsage} quoting a value that is none.
  static CommonKeys take(SourceUri& uri);

  /// Puts what was given into what the source says of itself.
  void apply(SourceInfo& info) const;

  /// Puts what was given into a frame. A pattern says nothing of a single frame that the images
  /// could not refute: where one was given it is the source's, and the frame's own illumination, of
  /// a recording, gives way to it; of a bracket, its exposure too. What was not given leaves the
  /// frame as it is.
  /// @param frame_period_ns from frame to frame; a field takes half of it.
  void apply(Frame& frame, std::int64_t frame_period_ns) const;
};

}  // namespace striper::detail
