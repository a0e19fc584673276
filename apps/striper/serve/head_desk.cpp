// SPDX-License-Identifier: Apache-2.0
#include "serve/head_desk.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>

#include "camera/why_json.hpp"

namespace striper::program {
namespace {

constexpr const char* kLaser = "laser";

ParameterValue value_of(const Control& control) {
  const ControlValue& value = control.state.value;
  if (control.type == ControlType::kSwitch) return value.at(0) != 0.0;
  if (control.type == ControlType::kNumber) return value.at(0);
  return value;
}

const char* type_of(ControlType type) {
  switch (type) {
    case ControlType::kNumber:
      return "number";
    case ControlType::kSwitch:
      return "switch";
    case ControlType::kRegion:
      return "region";
    case ControlType::kPose:
      break;
  }
  return "pose";
}

ControlValue control_value(const Parameter& wanted) {
  if (const auto* const is_on = std::get_if<bool>(&wanted.value)) return {*is_on ? 1.0 : 0.0};
  if (const auto* const number = std::get_if<double>(&wanted.value)) return {*number};
  if (const auto* const numbers = std::get_if<std::vector<double>>(&wanted.value)) return *numbers;
  throw Error(
      ErrorKind::kBadValue,
      fmt::format("{}: a number, a list of numbers, true or false is expected", wanted.name));
}

std::string describe(const Parameter& parameter) {
  struct Words {
    std::string operator()(std::monostate) const { return "the default"; }
    std::string operator()(bool is_on) const { return is_on ? "on" : "off"; }
    std::string operator()(double number) const { return fmt::format("{}", number); }
    std::string operator()(const std::string& word) const { return word; }
    std::string operator()(const std::vector<double>& numbers) const {
      return fmt::format("{}", fmt::join(numbers, ","));
    }
  };
  return fmt::format("{} is {} now", parameter.name, std::visit(Words{}, parameter.value));
}

}  // namespace

HeadDesk::HeadDesk(std::string name, const Behind& behind, bool may_switch_lasers_on)
    : name_(std::move(name)), behind_(behind), may_switch_lasers_on_(may_switch_lasers_on) {}

void HeadDesk::check_head(std::string_view head) const {
  if (head == name_) return;
  throw Error(ErrorKind::kNotFound, fmt::format("there is no head '{}'; there is {}", head, name_));
}

void HeadDesk::check_lasers_on(std::string_view what) const {
  if (may_switch_lasers_on_) return;
  throw Error(ErrorKind::kUnsupported,
              fmt::format("{} lights the lasers, which striper serve allows from another program "
                          "with --allow-lasers-on alone",
                          what));
}

void HeadDesk::note(const std::string& what) const { behind_.events.send({"command_taken", what}); }

bool HeadDesk::is_open() const {
  const SourceState state = behind_.head.health().state;
  return state == SourceState::kStreaming || state == SourceState::kSilent;
}

// A source that is not open has none.
std::vector<Control> HeadDesk::controls() const {
  return is_open() ? behind_.head.controls() : std::vector<Control>();
}

std::vector<Parameter> HeadDesk::parameters(std::string_view head) const {
  check_head(head);
  std::vector<Parameter> all;
  for (const Control& control : controls()) all.push_back({control.name, value_of(control)});
  for (Parameter& option : behind_.settings.list()) all.push_back(std::move(option));
  return all;
}

void HeadDesk::remember(const std::string& name, const ParameterValue& value) const {
  const std::lock_guard lock(mutex_);
  at_start_.try_emplace(name, value);
}

std::vector<ParameterForm> HeadDesk::forms(std::string_view head) const {
  check_head(head);
  std::vector<ParameterForm> all;
  for (const Control& control : controls()) {
    if (ScannerSettings::has(control.name)) continue;  // What is set by that name is the scanner's.
    ParameterForm form;
    form.name = control.name;
    form.is_control = true;
    form.type = type_of(control.type);
    form.unit = control.unit;
    form.minimum = control.state.minimum;
    form.maximum = control.state.maximum;
    form.is_writable = control.state.is_writable;
    form.value = value_of(control);
    all.push_back(std::move(form));
  }
  for (ParameterForm& form : behind_.settings.forms()) all.push_back(std::move(form));
  for (ParameterForm& form : all) {
    if (is_open()) remember(form.name, form.value);
    const std::lock_guard lock(mutex_);
    const auto first = at_start_.find(form.name);
    form.at_start = first == at_start_.end() ? form.value : first->second;
  }
  return all;
}

void HeadDesk::set(std::string_view head, const Parameter& wanted) {
  for (const Parameter& now : parameters(head)) {
    if (now.name == wanted.name) remember(now.name, now.value);
  }
  if (ScannerSettings::has(wanted.name)) {
    behind_.settings.set(wanted);
    behind_.head.remake_scanner();
    return note(describe(wanted));
  }
  const ControlValue value = control_value(wanted);
  if (wanted.name == kLaser) {
    if (value != ControlValue{0.0}) check_lasers_on("laser");
    behind_.head.switch_lasers(value != ControlValue{0.0});
    return note(describe(wanted));
  }
  const Control now = behind_.head.set_control(wanted.name, value);
  note(describe({now.name, value_of(now)}));
}

// One that cannot say is taken to.
bool HeadDesk::fires_lasers() const {
  try {
    const std::vector<Control> all = behind_.head.controls();
    return std::any_of(all.begin(), all.end(),
                       [](const Control& control) { return control.name == kLaser; });
  } catch (const Error&) {
    return true;
  }
}

void HeadDesk::stop() {
  if (!is_stopped_.exchange(true)) fired_lasers_ = fires_lasers();
  behind_.head.pause();
}

void HeadDesk::start() {
  if (is_stopped_ && fired_lasers_) check_lasers_on("start");
  is_stopped_ = false;
  behind_.head.resume();
}

std::string HeadDesk::record(double seconds) {
  if (behind_.recorder == nullptr) {
    throw Error(ErrorKind::kUnsupported, fmt::format("{} is a recording already", name_));
  }
  return fmt::format("recording {} s to '{}'", seconds, behind_.recorder->begin(seconds).string());
}

std::string HeadDesk::command(std::string_view head, HeadCommand command, double seconds) {
  check_head(head);
  std::string done;
  switch (command) {
    case HeadCommand::kStart:
      start();
      done = "started";
      break;
    case HeadCommand::kStop:
      stop();
      done = "stopped";
      break;
    case HeadCommand::kLasersOff:
      behind_.head.switch_lasers(false);
      done = "lasers off";
      break;
    case HeadCommand::kLasersOn:
      check_lasers_on("lasers_on");
      behind_.head.switch_lasers(true);
      done = "lasers on";
      break;
    case HeadCommand::kRecord:
      done = record(seconds);
      break;
  }
  note(done);
  return done;
}

std::string HeadDesk::why(std::string_view head, int line) const {
  check_head(head);
  return to_json(behind_.head.health().read.frames, behind_.head.explain(line)).dump();
}

}  // namespace striper::program
