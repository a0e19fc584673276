// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>

#include <striper/core/csv_table.hpp>

#include "options/own_files.hpp"

namespace striper::program {

/// The table of what is found, if one is wanted. It is begun with the first scan: what fails before
/// leaves an older table as it is. @throws Error{kUsage} where the file is there and is none.
template <typename Line>
class FollowTable {
 public:
  FollowTable(std::optional<std::string> file, std::span<const CsvColumn<Line>> columns)
      : file_(std::move(file)), columns_(columns) {
    if (file_) require_replaceable_table(*file_, columns_);
  }

  void begin() {
    if (file_ && !table_) table_.emplace(*file_, columns_);
  }
  void add(const Line& line) {
    if (table_) table_->add(line);
  }
  void flush() {
    if (table_) table_->flush();
  }
  void close() {
    if (table_) table_->close();
  }

 private:
  std::optional<std::string> file_;
  std::span<const CsvColumn<Line>> columns_;
  std::optional<CsvWriter<Line>> table_;
};

}  // namespace striper::program
