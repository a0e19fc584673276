// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <yaml-cpp/yaml.h>

namespace striper::detail {

/// The text under the top-level key `quality`, with its comments, its common indentation
/// removed, every line ended. Where the text cannot be cut out (the whole file is in flow
/// style), the value is written anew.
/// @param root the document of `yaml`, which has a key `quality`.
std::string quality_text(const std::string& yaml, const YAML::Node& root);

}  // namespace striper::detail
