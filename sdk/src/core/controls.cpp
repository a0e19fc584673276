// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/controls.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr std::size_t kRegionNumbers = 4;
constexpr std::size_t kPoseNumbers = 6;

std::string expected_of(ControlType type) {
  switch (type) {
    case ControlType::kNumber:
      return "a number";
    case ControlType::kSwitch:
      return "on or off";
    case ControlType::kRegion:
      return "left,top,width,height";
    case ControlType::kPose:
      return "x_m,y_m,z_m,roll_deg,pitch_deg,yaw_deg";
  }
  return {};
}

std::optional<double> parse_number(std::string_view text) {
  double number = 0.0;
  const char* const last = text.data() + text.size();
  const auto [end, failure] = std::from_chars(text.data(), last, number);
  if (failure != std::errc() || end != last || !std::isfinite(number)) return std::nullopt;
  return number;
}

std::string range_of(const Control& control) {
  if (control.type == ControlType::kSwitch) return expected_of(control.type);
  const std::string unit = control.unit.empty() ? "" : " " + control.unit;
  const ControlState& state = control.state;
  if (control.type == ControlType::kNumber)
    return fmt::format("{} to {}{}", state.minimum[0], state.maximum[0], unit);
  return fmt::format("{} from {} to {}{}", expected_of(control.type), fmt::join(state.minimum, ","),
                     fmt::join(state.maximum, ","), unit);
}

bool is_within(const ControlValue& value, const Control& control) {
  if (value.size() != control_size(control.type)) return false;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const bool is_whole = control.type != ControlType::kSwitch || std::floor(value[i]) == value[i];
    const bool fits = value[i] >= control.state.minimum[i] && value[i] <= control.state.maximum[i];
    if (!is_whole || !fits) return false;  // A NaN does not fit either.
  }
  return true;
}

}  // namespace

std::size_t control_size(ControlType type) noexcept {
  if (type == ControlType::kRegion) return kRegionNumbers;
  return type == ControlType::kPose ? kPoseNumbers : 1;
}

std::string format_control(ControlType type, const ControlValue& value) {
  if (type == ControlType::kSwitch && value.size() == 1) return value[0] != 0.0 ? "on" : "off";
  return fmt::format("{}", fmt::join(value, ","));
}

ControlValue parse_control(ControlType type, std::string_view text) {
  if (type == ControlType::kSwitch && (text == "on" || text == "off"))
    return {text == "on" ? 1.0 : 0.0};
  ControlValue value;
  std::string_view rest = text;
  while (type != ControlType::kSwitch) {
    const std::size_t comma = rest.find(',');
    const std::optional<double> number = parse_number(rest.substr(0, comma));
    if (!number) break;
    value.push_back(*number);
    if (comma == std::string_view::npos) {
      if (value.size() == control_size(type)) return value;
      break;
    }
    rest.remove_prefix(comma + 1);
  }
  throw Error(ErrorKind::kBadValue, fmt::format("'{}' - expected {}", text, expected_of(type)));
}

struct Controls::State {
  const ControlRow& find(std::string_view name) const {
    std::vector<std::string> names;
    for (const ControlRow& row : rows) {
      if (row.name == name && !row.read().value.empty()) return row;
      if (row.name != name) names.push_back(row.name);
    }
    throw Error(ErrorKind::kUsage,
                names.empty() ? fmt::format("'{}' has no controls, so no '{}'", source, name)
                              : fmt::format("'{}' has no control '{}'; it knows {}", source, name,
                                            fmt::join(names, ", ")));
  }
  static Control control_of(const ControlRow& row) {
    Control control{row.name, row.type, row.unit, row.read()};
    control.state.is_writable = control.state.is_writable && row.write != nullptr;
    return control;
  }
  void check(const Control& control, const ControlValue& value) const {
    if (!control.state.is_writable) {
      throw Error(ErrorKind::kUnsupported,
                  fmt::format("'{}': {}={} - it cannot be set now; it is {}", source, control.name,
                              format_control(control.type, value),
                              format_control(control.type, control.state.value)));
    }
    if (is_within(value, control)) return;
    throw Error(ErrorKind::kBadValue,
                fmt::format("'{}': {}={} - expected {}", source, control.name,
                            format_control(control.type, value), range_of(control)));
  }

  std::string source;
  std::vector<ControlRow> rows;
  mutable std::mutex mutex;
};

Controls::Controls() : Controls("this source", {}) {}
Controls::Controls(std::string source, std::vector<ControlRow> rows)
    : state_(std::make_unique<State>()) {
  state_->source = std::move(source);
  state_->rows = std::move(rows);
}
Controls::Controls(Controls&&) noexcept = default;
Controls& Controls::operator=(Controls&&) noexcept = default;
Controls::~Controls() = default;

std::vector<Control> Controls::list() const {
  const std::lock_guard lock(state_->mutex);
  std::vector<Control> controls;
  for (const ControlRow& row : state_->rows) {
    Control control = State::control_of(row);
    if (!control.state.value.empty()) controls.push_back(std::move(control));
  }
  return controls;
}

Control Controls::get(std::string_view name) const {
  const std::lock_guard lock(state_->mutex);
  return State::control_of(state_->find(name));
}

Control Controls::set(std::string_view name, const ControlValue& value) {
  const std::lock_guard lock(state_->mutex);
  const ControlRow& row = state_->find(name);
  state_->check(State::control_of(row), value);
  row.write(value);
  return State::control_of(row);
}

}  // namespace striper
