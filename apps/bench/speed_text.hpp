// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "speed_table.hpp"

namespace striper::speed {

/// The table for people, 100 columns wide.
std::string to_text(const SpeedTable& table);

/// The same for programs.
nlohmann::json to_json(const SpeedTable& table);

}  // namespace striper::speed
