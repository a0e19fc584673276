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

/// Writes a file that appears whole or not at all: written beside, flushed to the disk, renamed.
/// The target of a symbolic link is replaced or made, not the link; what is there and is no regular
/// file (a pipe, /dev/stdout into one) is written straight. Thread-safe.
/// @throws Error{kIo} naming the file and the reason; the old file is then untouched.
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

/// Throws what `write_file_atomically` would for want of a directory or a permission: before long
/// work whose result is to be written there. Leaves no trace. Not foreseen: a disk that fills up
/// later, somebody else's file in a directory like /tmp, where only owners may replace theirs.
void require_writable(const std::filesystem::path& path);

}  // namespace striper
