// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <striper/simulator/scene.hpp>

namespace striper {

/// Reads a scene file; every key, its unit and its default are in data/scenes/README.md.
///
/// @throws Error{kNotFound} where there is no such file, Error{kBadFile} quoting the file, the
/// field, the value and what was expected for everything else; an unknown key is refused too.
Scene load_scene(const std::filesystem::path& path);

/// The same from text; `name` stands for the file in messages.
Scene parse_scene(const std::string& yaml, const std::string& name);

}  // namespace striper
