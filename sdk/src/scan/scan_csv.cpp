// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <striper/scan/scan_csv.hpp>

#include "scan/scan_columns.hpp"
#include "scan/scan_table.hpp"

namespace striper {
namespace {

using detail::ScanRow;

// A sensor has fewer scan lines, times a few peaks each: more is a table of something else.
constexpr std::size_t kMostReturns = std::size_t{1} << 20;

bool is_same_scan(const ScanRow& a, const ScanRow& b) {
  return a.frame == b.frame && a.time_s == b.time_s && a.laser == b.laser;
}

bool is_whole(double value) { return value == std::floor(value); }

}  // namespace

struct ScanCsvReader::State {
  State(CsvInput input, const ScanCsvOptions& given)
      : reader(std::move(input), detail::scan_columns(), "table of scans"),
        options(given),
        axis(given.axis),
        has_status(reader.has("status")),
        has_sigma(reader.has("sigma_m")),
        has_points(reader.has("x_m") && reader.has("y_m")),
        has_pixels(reader.has("u_px") && reader.has("v_px")) {}

  bool read_row();
  StripeAxis axis_of(const PolarScan& scan);

  CsvReader<ScanRow> reader;
  ScanCsvOptions options;
  StripeAxis axis;  // Of the last scan that showed it.
  bool has_status;
  bool has_sigma;
  bool has_points;
  bool has_pixels;
  bool is_begun = false;
  bool has_row = false;
  ScanRow row;  // The first of the scan to come.
};

// What this table does not have is as in a new row, whatever the last one had.
bool ScanCsvReader::State::read_row() {
  row = {};
  has_row = reader.next(row);
  if (!has_row) return false;
  Return& r = row.point;
  const bool has_range = !std::isnan(r.range_m);
  const std::string problem = detail::problem_of_bearing(r.bearing_rad);
  if (!problem.empty()) reader.input().refuse(problem);
  if (!has_status) r.status = has_range ? ReturnStatus::kOk : ReturnStatus::kNoStripe;
  if (!has_sigma && has_range) r.sigma_m = options.sigma_m;
  if (!has_points && has_range) {
    r.x_m = r.range_m * std::cos(r.bearing_rad);
    r.y_m = r.range_m * std::sin(r.bearing_rad);
  }
  return true;
}

StripeAxis ScanCsvReader::State::axis_of(const PolarScan& scan) {
  if (!has_pixels) return axis;
  const auto all_whole = [&](double Return::*coordinate) {
    return std::all_of(scan.returns.begin(), scan.returns.end(),
                       [&](const Return& r) { return is_whole(r.*coordinate); });
  };
  const bool u_is_whole = all_whole(&Return::u_px);
  const bool v_is_whole = all_whole(&Return::v_px);
  if (u_is_whole != v_is_whole) axis = u_is_whole ? StripeAxis::kColumns : StripeAxis::kRows;
  return axis;
}

ScanCsvReader::ScanCsvReader(const std::filesystem::path& path, const ScanCsvOptions& options)
    : ScanCsvReader(CsvInput::open(path), options) {}

ScanCsvReader::ScanCsvReader(CsvInput input, const ScanCsvOptions& options)
    : state_(std::make_unique<State>(std::move(input), options)) {}

ScanCsvReader::ScanCsvReader(ScanCsvReader&&) noexcept = default;
ScanCsvReader& ScanCsvReader::operator=(ScanCsvReader&&) noexcept = default;
ScanCsvReader::~ScanCsvReader() = default;

bool ScanCsvReader::next(PolarScan& scan) {
  State& s = *state_;
  if (!std::exchange(s.is_begun, true)) s.read_row();
  if (!s.has_row) return false;
  const ScanRow first = s.row;
  scan.sequence = first.frame;
  scan.time = FrameTime::at_seconds(first.time_s);
  scan.laser = first.laser;
  scan.field = Field::kProgressive;
  scan.returns.clear();
  do {
    if (scan.returns.size() == kMostReturns) {
      s.reader.input().refuse(fmt::format("more than {} lines of one scan (frame {}, time_s {})",
                                          kMostReturns, first.frame, first.time_s));
    }
    scan.returns.push_back(s.row.point);
  } while (s.read_row() && is_same_scan(s.row, first));
  scan.axis = s.axis_of(scan);
  scan.is_stripe_seen = std::any_of(scan.returns.begin(), scan.returns.end(), [](const Return& r) {
    return verdict(r.status) != Verdict::kMissing;
  });
  return true;
}

std::size_t ScanCsvReader::cut_line() const noexcept { return state_->reader.cut_line(); }

}  // namespace striper
