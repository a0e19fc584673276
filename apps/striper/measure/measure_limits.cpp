// SPDX-License-Identifier: Apache-2.0
#include "measure/measure_limits.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>

namespace striper::program {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// `otherwise` where there is no text; NaN where it is no number.
double number_of(std::string_view text, double otherwise) {
  if (text.empty()) return otherwise;
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc{} && end == text.data() + text.size();
  return is_number ? value : std::numeric_limits<double>::quiet_NaN();
}

nlohmann::json side(double value) {
  if (std::isinf(value)) return nullptr;
  return value;
}

}  // namespace

MeasureLimits::MeasureLimits(const std::vector<std::string>& texts) {
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::size_t dots = equals == std::string::npos ? equals : text.find("..", equals);
    if (equals == 0 || dots == std::string::npos)
      throw Error(ErrorKind::kUsage, fmt::format("--limit {}: expected NAME=A..B", text));
    const std::string_view all = text;
    Limit limit{text.substr(0, equals),
                number_of(all.substr(equals + 1, dots - equals - 1), -kInfinity),
                number_of(all.substr(dots + 2), kInfinity)};
    if (!(limit.from <= limit.to))
      throw Error(ErrorKind::kUsage,
                  fmt::format("--limit {}: expected two numbers, the smaller one first", text));
    limits_.push_back(limit);
  }
}

void MeasureLimits::require_rows(const std::vector<std::string>& rows) {
  for (Limit& limit : limits_) {
    if (std::find(rows.begin(), rows.end(), limit.row) != rows.end()) continue;
    std::vector<std::string> of_tool;
    for (const std::string& row : rows)
      if (row.starts_with(limit.row + ".")) of_tool.push_back(row);
    if (of_tool.size() != 1)
      throw Error(ErrorKind::kUsage,
                  fmt::format("--limit {}: nothing of that name is measured; expected one of {}",
                              limit.row, fmt::join(of_tool.empty() ? rows : of_tool, ", ")));
    limit.row = of_tool.front();
  }
}

// How far outside; not above 0 inside.
double MeasureLimits::Limit::excess(double value) const noexcept {
  return std::max(from - value, value - to);
}

std::string MeasureLimits::Limit::interval() const {
  return fmt::format("{}..{}", std::isinf(from) ? "" : fmt::format("{}", from),
                     std::isinf(to) ? "" : fmt::format("{}", to));
}

void MeasureLimits::look_at(const Measurement& m, std::uint64_t frame, const EventPort& events) {
  for (Limit& limit : limits_) {
    if (limit.row != m.tool || m.status != MeasureStatus::kOk) continue;
    ++limit.measured;
    const bool was_outside = limit.is_outside;
    limit.is_outside = limit.excess(m.value) > 0.0;
    if (!limit.is_outside) continue;
    if (++limit.broken == 1 || limit.excess(m.value) > limit.excess(limit.worst))
      limit.worst = m.value;
    if (was_outside) continue;
    events.send(
        {"limit_broken", fmt::format("frame {}: {} is {:.6g} {} +- {:.2g}, outside {}", frame,
                                     m.tool, m.value, m.unit, m.sigma, limit.interval())});
  }
}

bool MeasureLimits::are_kept() const {
  return std::all_of(limits_.begin(), limits_.end(),
                     [](const Limit& limit) { return limit.is_kept(); });
}

std::vector<std::string> MeasureLimits::verdicts() const {
  std::vector<std::string> lines;
  for (const Limit& limit : limits_) {
    std::string text = fmt::format("limit {} of {}: ", limit.interval(), limit.row);
    if (limit.measured == 0)
      text += "never measured";
    else if (limit.broken == 0)
      text += "kept";
    else
      text += fmt::format("broken in {} of {} scans, {:.6g} at worst", limit.broken, limit.measured,
                          limit.worst);
    lines.push_back(text);
  }
  return lines;
}

nlohmann::json MeasureLimits::to_json() const {
  nlohmann::json json = nlohmann::json::array();
  for (const Limit& limit : limits_) {
    json.push_back({{"tool", limit.row},
                    {"from", side(limit.from)},
                    {"to", side(limit.to)},
                    {"measured", limit.measured},
                    {"broken", limit.broken},
                    {"worst", nullptr}});
    if (limit.broken > 0) json.back()["worst"] = limit.worst;
  }
  return json;
}

}  // namespace striper::program
