// SPDX-License-Identifier: Apache-2.0
#include <striper/core/whole_file.hpp>
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
  require_replaceable(path, {header_line()}, "scans");
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
