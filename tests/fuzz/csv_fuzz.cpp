// SPDX-License-Identifier: Apache-2.0
// Whatever bytes a scans CSV has, it gives scans that can be written and read back to the same
// text, or Error{kBadFile}. Seeds: csv_seeds.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <striper/core/error.hpp>
#include <striper/scan/scan_csv.hpp>

#include "scan/scan_table.hpp"

namespace {

using striper::CsvInput;
using striper::detail::ScanRow;

std::string read_and_format(const std::string& text) {
  using Writer = striper::CsvWriter<ScanRow>;
  std::string formatted;
  Writer::append_header(formatted, striper::detail::scan_columns());
  striper::ScanCsvReader scans(CsvInput::of_text("fuzz.csv", text));
  for (striper::PolarScan scan; scans.next(scan);) continue;
  striper::CsvReader<ScanRow> rows(CsvInput::of_text("fuzz.csv", text),
                                   striper::detail::scan_columns(), "table of scans");
  for (ScanRow row; rows.next(row); row = {})
    Writer::append(formatted, striper::detail::scan_columns(), row);
  return formatted;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string formatted;
  try {
    formatted = read_and_format({data, data + size});
  } catch (const striper::Error& error) {
    if (error.kind() != striper::ErrorKind::kBadFile) std::abort();
    return 0;
  }
  if (read_and_format(formatted) != formatted) std::abort();
  return 0;
}
