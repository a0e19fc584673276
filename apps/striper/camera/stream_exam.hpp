// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>
#include <striper/stream/frame_reader.hpp>

namespace striper::program {

/// What is wrong with how frames came: lost, late, damaged, and what to do about it. Nothing
/// where all is well.
void conclude_stream(const FrameReport& report, const SourceInfo& info,
                     std::vector<Event>& findings);

}  // namespace striper::program
