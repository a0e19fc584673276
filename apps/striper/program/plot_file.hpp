// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace striper::program {

/// Refuses, before the work whose plot it is, a file that is not called .svg, one that is there and
/// is no SVG, and one whose folder is not there or may not be written. A device or a pipe passes.
/// @param option  that named it, for the message: "--plot".
/// @throws Error{kUsage} or {kIo} naming both.
void require_plot_file(std::string_view option, const std::optional<std::string>& path);

/// Writes it, whole or not at all, and says so. @throws Error{kIo}.
void write_plot_file(const std::string& path, std::string_view svg);

}  // namespace striper::program
