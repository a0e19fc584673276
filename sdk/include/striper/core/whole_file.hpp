// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <initializer_list>
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

/// Throws where a file is there that is not of the kind that is to replace it: a model or a picture
/// whose name was given by mistake. An empty file may be replaced, one that begins with one of
/// `beginnings`, and one that is all of it a part of such a beginning, as a full disk leaves it;
/// so may what is no regular file. Thread-safe.
/// @param kind  for the message: "scans", "a plot".
/// @throws Error{kUsage} naming the file and what to do.
void require_replaceable(const std::filesystem::path& path,
                         std::initializer_list<std::string_view> beginnings, std::string_view kind);

}  // namespace striper
