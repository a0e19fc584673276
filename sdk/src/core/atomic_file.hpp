// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace striper::detail {

/// Writes a file that appears whole or not at all: written beside, flushed to the disk, renamed.
/// The target of a symbolic link is replaced, not the link; something that is no regular file (a
/// pipe, /dev/stdout) is written straight.
/// @throws Error{kIo} naming the file and the reason; the old file is then untouched.
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

}  // namespace striper::detail
