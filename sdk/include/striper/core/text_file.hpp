// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace striper {

/// Reads a text file whole: a model, a scene, a camera; at most 16 MiB. Thread-safe.
/// @param expected what it should be, to end messages with: "a striper model".
/// @throws Error naming the file: kNotFound where there is none, kIo where it cannot be read,
///         kBadFile where it is a directory or larger.
std::string read_text_file(const std::filesystem::path& path, std::string_view expected);

}  // namespace striper
