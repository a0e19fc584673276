// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <striper/core/csv_cell.hpp>
#include <striper/guidance/beam_sweep.hpp>

namespace striper {
namespace {

constexpr std::array<std::string_view, 3> kFirstColumns{"time_s", "odometer_counts", "beam"};
constexpr std::size_t kLinesAtOnce = 64;

[[noreturn]] void refuse_cell(const CsvInput& input, std::string_view column,
                              std::string_view expected) {
  input.refuse(fmt::format("column {} - expected {}", column, expected));
}

}  // namespace

SweepReader::SweepReader(CsvInput input) : input_(std::move(input)) {
  const bool has_header = input_.next();
  const auto cells = input_.cells();
  bool is_sweeps = has_header && cells.size() > kFirstColumns.size();
  for (std::size_t i = 0; is_sweeps && i < kFirstColumns.size(); ++i) {
    is_sweeps = cells[i] == kFirstColumns[i];
  }
  for (std::size_t i = kFirstColumns.size(); is_sweeps && i < cells.size(); ++i) {
    is_sweeps = cells[i] == fmt::format("s{}", i - kFirstColumns.size());
  }
  if (!is_sweeps)
    input_.refuse("no table of sweeps: expected time_s,odometer_counts,beam,s0,s1,...");
  columns_ = cells.size();
}

bool SweepReader::next(BeamSweep& sweep) {
  if (!input_.next()) return false;
  const auto cells = input_.cells();
  if (!input_.is_ended()) {
    cut_line_ = input_.line();
    return false;
  }
  if (cells.size() > columns_ || cells.size() < kFirstColumns.size()) {
    input_.refuse(
        fmt::format("{} cells - expected {} to {}", cells.size(), kFirstColumns.size(), columns_));
  }
  if (!read_cell(cells[0], sweep.time_s) || !std::isfinite(sweep.time_s)) {
    refuse_cell(input_, "time_s", "a number of seconds");
  }
  if (!read_cell(cells[1], sweep.odometer_counts)) {
    refuse_cell(input_, "odometer_counts", "a whole number");
  }
  if (!read_cell(cells[2], sweep.beam) || sweep.beam.empty()) {
    refuse_cell(input_, "beam", "a beam's name");
  }
  sweep.samples.clear();
  for (const std::string_view cell : cells.subspan(kFirstColumns.size())) {
    if (cell.empty()) break;
    double value = 0.0;
    if (!read_cell(cell, value) || !std::isfinite(value)) {
      refuse_cell(input_, fmt::format("s{}", sweep.samples.size()), "a number");
    }
    sweep.samples.push_back(value);
  }
  return true;
}

SweepReader open_sweeps_csv(const std::filesystem::path& path) {
  return SweepReader(CsvInput::open(path));
}

SweepWriter::SweepWriter(std::string path, std::size_t samples) : output_(std::move(path)) {
  std::string& out = output_.lines();
  out += "time_s,odometer_counts,beam";
  for (std::size_t i = 0; i < samples; ++i) out += fmt::format(",s{}", i);
  out += '\n';
  output_.flush();
}

void SweepWriter::add(const BeamSweep& sweep) {
  std::string& out = output_.lines();
  write_cell(out, sweep.time_s);
  out += ',';
  write_cell(out, sweep.odometer_counts);
  out += ',';
  write_cell(out, std::string_view(sweep.beam));
  for (const double sample : sweep.samples) {
    out += ',';
    write_cell(out, sample);
  }
  out += '\n';
  if (++waiting_ < kLinesAtOnce) return;
  waiting_ = 0;
  output_.flush();
}

void SweepWriter::close() { output_.close(); }

}  // namespace striper
