// SPDX-License-Identifier: Apache-2.0
#include "program/plot_file.hpp"

#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>

#include "program/terminal.hpp"

namespace striper::program {

void require_plot_file(std::string_view option, const std::optional<std::string>& path) {
  if (!path) return;
  const std::filesystem::path file = *path;
  std::error_code ignored;
  if (file.native().starts_with("/dev/") || std::filesystem::is_fifo(file, ignored)) return;
  if (std::filesystem::is_directory(file, ignored) || file.extension() != ".svg")
    throw Error(ErrorKind::kUsage,
                fmt::format("{} '{}': what is written is SVG; name a FILE.svg", option, *path));
  require_replaceable(file, {"<svg", "<?xml"}, "SVG");
  const auto folder = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw Error(ErrorKind::kIo,
                fmt::format("{} '{}': there is no folder {}", option, *path, folder.string()));
  require_writable(file);
}

void write_plot_file(const std::string& path, std::string_view svg) {
  write_file_atomically(path, svg);
  say(fmt::format("wrote {}", path));
}

}  // namespace striper::program
