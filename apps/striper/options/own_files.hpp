// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include <striper/core/csv_table.hpp>
#include <striper/core/whole_file.hpp>

namespace striper::program {

/// Refuses to write a file that is read, or one file twice, before anything is opened.
///
/// @param read,written paths, of addresses their `Uri::path()`; what is no file, as `-` or a port,
/// is passed over, and so are devices.
/// @throws Error{kUsage} naming the file.
void require_own_files(const std::vector<std::string>& read,
                       const std::vector<std::string>& written);

/// Refuses to write a table over a file that is there and does not begin as the table does.
/// @throws Error{kUsage} naming the file.
template <typename Line>
void require_replaceable_table(const std::string& path, std::span<const CsvColumn<Line>> columns) {
  std::string header;
  CsvWriter<Line>::append_header(header, columns);
  require_replaceable(path, {header}, "table of this kind");
}

}  // namespace striper::program
