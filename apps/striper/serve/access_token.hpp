// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <striper/core/event.hpp>

namespace striper::program {

/// The secret that whoever changes something over the network has to show: the first line of a file
/// that its owner alone may read; the file is made where there is none, of 256 random bits, and its
/// path is said (token_made).
/// @param file as it was named; without it `token` in `state_folder()`, and where that cannot be
///        had there is no secret (token_missing): nothing can be changed then.
/// @return empty where there is none.
/// @throws Error{kIo} where a named file cannot be read or made, Error{kBadFile} where others may
///         read the file or its secret is short.
std::string access_token(const std::optional<std::filesystem::path>& file, const EventPort& events);

}  // namespace striper::program
