// SPDX-License-Identifier: Apache-2.0
#include "guide/guidance_lines.hpp"

#include <exception>
#include <span>

#include <nlohmann/json.hpp>

#include <striper/guidance/guidance_csv.hpp>

namespace striper::program {
namespace {

// A cell in the quotes of a table, as the text that it is of.
std::string text_of(std::string_view cell) {
  if (!cell.starts_with('"')) return std::string(cell);
  std::string text;
  for (std::size_t i = 1; i + 1 < cell.size(); ++i) {
    text += cell[i];
    if (cell[i] == '"') ++i;
  }
  return text;
}

nlohmann::ordered_json value_of(std::string_view cell, bool is_text) {
  if (is_text) return text_of(cell);
  if (cell.empty()) return nullptr;
  return nlohmann::ordered_json::parse(cell, nullptr, false);
}

template <typename Row>
nlohmann::ordered_json json_of(const char* table, std::span<const CsvColumn<Row>> columns,
                               const Row& row) {
  nlohmann::ordered_json json{{"table", table}};
  std::string cell;
  for (const CsvColumn<Row>& column : columns) {
    cell.clear();
    column.write(cell, row);
    json[std::string(column.name)] = value_of(cell, column.is_text);
  }
  return json;
}

std::uint64_t append(AppendFile& output, const nlohmann::ordered_json& json) {
  output.lines() += json.dump();
  output.lines() += '\n';
  output.flush();
  return 1;
}

}  // namespace

GuidanceLines::GuidanceLines(const GuidanceConfig& config, const std::string& path)
    : output_(path), is_on_(config.guns.size(), 0), volts_safe_(config.output.volts_safe) {
  for (const GuidanceGun& gun : config.guns) guns_.push_back(gun.name);
}

GuidanceLines::~GuidanceLines() {
  try {
    finish();
  } catch (const std::exception&) {
    // What broke the run off is told; this would hide it.
  }
}

void GuidanceLines::lateral(const LateralLine& line) {
  now_s_ = line.time_s;
  written_ += append(output_, json_of("lateral", lateral_columns(), line));
}
void GuidanceLines::switch_gun(std::size_t gun, bool is_on, double time_s) {
  now_s_ = time_s;
  if ((is_on_[gun] != 0) == is_on) return;
  is_on_[gun] = is_on ? 1 : 0;
  written_ += append(
      output_, {{"table", "switch"}, {"gun", guns_[gun]}, {"is_on", is_on}, {"time_s", time_s}});
}
void GuidanceLines::gun(const GunLine& line) {
  written_ += append(output_, json_of("guns", gun_columns(), line));
}
void GuidanceLines::seen(const SeenLine& line) {
  written_ += append(output_, json_of("seen", seen_columns(), line));
}
void GuidanceLines::fault(const FaultLine& line) {
  now_s_ = line.time_s;
  written_ += append(output_, json_of("faults", fault_columns(), line));
}
void GuidanceLines::switch_laser_off(double time_s) {
  now_s_ = time_s;
  written_ += append(output_, {{"table", "laser_off"}, {"time_s", time_s}});
}

void GuidanceLines::finish() {
  if (!output_.is_open()) return;
  for (std::size_t gun = 0; gun < guns_.size(); ++gun) {
    if (is_on_[gun] != 0) switch_gun(gun, false, now_s_);
  }
  written_ += append(output_, {{"table", "safe"}, {"time_s", now_s_}, {"volts", volts_safe_}});
  output_.close();
}

GuidanceLines::Account GuidanceLines::account() const { return {written_, 0, "line", {}}; }

}  // namespace striper::program
