// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <striper/stream/recording_info.hpp>

namespace striper::program {

/// What is in a recording, for programs.
nlohmann::json to_json(const RecordingInfo& info);

}  // namespace striper::program
