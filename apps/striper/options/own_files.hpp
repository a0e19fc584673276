// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace striper::program {

/// Refuses to write a file that is read, or one file twice, before anything is opened.
///
/// @param read,written paths, of addresses their `Uri::path()`; what is no file, as `-` or a port,
/// is passed over, and so are devices.
/// @throws Error{kUsage} naming the file.
void require_own_files(const std::vector<std::string>& read,
                       const std::vector<std::string>& written);

}  // namespace striper::program
