// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/sinks/csv_sink.hpp>

#include "scan/scan_table.hpp"

namespace striper {
namespace {

using ScanWriter = CsvWriter<detail::ScanRow>;

bool wanted(const CsvOptions& options, ReturnStatus status) {
  switch (verdict(status)) {
    case Verdict::kGood:
      return true;
    case Verdict::kDoubtful:
      return options.doubtful;
    case Verdict::kMissing:
      return options.missing;
  }
  return false;
}

std::string header_line() {
  std::string line;
  ScanWriter::append_header(line, detail::scan_columns());
  return line;
}

// Before it is opened, and so emptied.
const std::string& replaceable(const std::string& path) {
  require_replaceable_by_scans(path);
  return path;
}

}  // namespace

struct CsvSink::Table : ScanWriter {
  using ScanWriter::ScanWriter;
};

void require_replaceable_by_scans(const std::string& path) {
  std::error_code ignored;
  if (path == "-" || !std::filesystem::is_regular_file(path, ignored)) return;
  const std::string header = header_line();
  std::ifstream file(path, std::ios::binary);
  std::string begin(header.size(), '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  if (header.starts_with(begin)) return;  // Scans, or as much of their header as a disk could hold.
  throw Error(ErrorKind::kUsage,
              fmt::format("'{}' is there and holds no scans: it is not overwritten; remove it, or "
                          "name another file",
                          path));
}

CsvSink::CsvSink(const std::string& path, const CsvOptions& options)
    : options_(options),
      table_(std::make_unique<Table>(replaceable(path), detail::scan_columns())) {}

CsvSink::~CsvSink() = default;

void CsvSink::write(const PolarScan& scan) {
  std::uint64_t lines = 0;
  detail::ScanRow row{scan.sequence, scan.time.seconds(), scan.laser, {}};
  for (const Return& r : scan.returns) {
    if (!wanted(options_, r.status)) continue;
    row.point = r;
    table_->add(row);
    ++lines;
  }
  table_->flush();
  lines_ += lines;
}

void CsvSink::close() { table_->close(); }

}  // namespace striper
