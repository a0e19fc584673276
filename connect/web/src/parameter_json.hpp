// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <striper/stream/sink_services.hpp>

namespace striper::detail {

/// `null`, a boolean, a number, a text or a list of numbers.
nlohmann::json to_json(const ParameterValue& value);

/// The same backwards. @throws Error{kBadValue} naming the parameter.
Parameter parameter_of(const std::string& name, const nlohmann::json& value);

/// What others say as JSON, which is not deeper than anything that is said here.
/// @throws Error{kBadValue}.
nlohmann::json parse_json(std::string_view text);

/// On one line. Texts of others may be no UTF-8, which must not end anything.
std::string dump_json(const nlohmann::json& value);

}  // namespace striper::detail
