// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <yaml-cpp/yaml.h>

namespace striper::detail {

/// Parses one YAML document. Refuses aliases, which no file of ours needs and which can tie a tree
/// into a loop or blow it up, and lists or maps nested more than 32 deep.
/// @throws Error{kBadFile} with file and line.
YAML::Node parse_yaml(const std::string& text, const std::string& file);

/// `FILE:LINE`, or `FILE` where the mark says no line.
std::string yaml_place(const std::string& file, const YAML::Mark& mark);

/// A value for a message: in quotes, cut to a sensible length, control characters escaped.
std::string in_quotes(std::string_view text);

}  // namespace striper::detail
