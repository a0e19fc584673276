// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <nlohmann/json_fwd.hpp>

#include <striper/pipeline/scan_explanation.hpp>

namespace striper::program {

/// All of an explanation, for programs. @param frame number of the frame.
nlohmann::json to_json(std::uint64_t frame, const ScanExplanation& why);

}  // namespace striper::program
