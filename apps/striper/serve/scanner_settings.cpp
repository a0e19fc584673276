// SPDX-License-Identifier: Apache-2.0
#include "serve/scanner_settings.hpp"

#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/pipeline/scanner_option.hpp>

namespace striper::program {
namespace {

// A limit that there is not has no value.
ParameterValue value_of(const ScannerOption& option, const std::string& text) {
  if (text.empty()) return {};
  if (!option.is_number()) return text;
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_number = error == std::errc() && std::isfinite(number);
  return is_number ? ParameterValue(number) : ParameterValue();
}

std::optional<std::string> text_of(const Parameter& wanted) {
  if (std::holds_alternative<std::monostate>(wanted.value)) return std::nullopt;
  if (const auto* const word = std::get_if<std::string>(&wanted.value)) return *word;
  if (const auto* const number = std::get_if<double>(&wanted.value)) {
    return fmt::format("{}", *number);
  }
  throw Error(ErrorKind::kBadValue,
              fmt::format("{}: a number, a word or null is expected", wanted.name));
}

// Who reaches the port does not choose which files of this machine are read.
void refuse_files(const ScannerOption& option) {
  if (option.form != "FILE") return;
  throw Error(ErrorKind::kUnsupported,
              fmt::format("{} names a file of this machine - give it where the program is started",
                          option.name));
}

}  // namespace

ScannerSettings::ScannerSettings(ScannerArguments arguments, std::string head, bool explains)
    : head_(std::move(head)), explains_(explains), arguments_(std::move(arguments)) {}

ScannerSetup ScannerSettings::setup(const ScannerArguments& arguments, const SourceInfo& source,
                                    const EventPort& events) const {
  ScannerSetup setup = scanner_setup(arguments, source, events);
  setup.options.head = head_;
  setup.options.stripe.can_explain = explains_;
  return setup;
}

HeadScanner ScannerSettings::make(const SourceInfo& source, const EventPort& events) {
  const std::lock_guard lock(mutex_);
  source_ = source;
  const ScannerSetup made = setup(arguments_, source, events);
  HeadScanner scanner{make_scanner(made), shared_model(made), made.options.stripe.axis,
                      made.options.adapts_exposure};
  options_ = made.options;
  return scanner;
}

std::vector<Parameter> ScannerSettings::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<Parameter> all;
  for (const ScannerOption& option : scanner_options()) {
    const auto given = arguments_.given.find(option.name);
    const bool is_given = given != arguments_.given.end();
    const std::string text = is_given ? given->second : option.get(options_);
    all.push_back({std::string(option.name), value_of(option, text)});
  }
  return all;
}

std::vector<ParameterForm> ScannerSettings::forms() const {
  std::vector<ParameterForm> all;
  const std::vector<Parameter> now = list();
  for (std::size_t i = 0; i < now.size(); ++i) {
    const ScannerOption& option = scanner_options()[i];
    ParameterForm form;
    form.name = now[i].name;
    form.type = option.is_number() ? "number" : "word";
    form.unit = option.unit;
    form.words.assign(option.words.begin(), option.words.end());
    if (option.is_number()) {
      form.minimum = {option.low};
      form.maximum = {option.high};
    }
    form.if_not_given = option.what_if_not_given;
    form.help = option.help;
    form.value = now[i].value;
    all.push_back(std::move(form));
  }
  return all;
}

ScannerArguments ScannerSettings::arguments() const {
  const std::lock_guard lock(mutex_);
  return arguments_;
}

bool ScannerSettings::has(std::string_view name) { return find_scanner_option(name) != nullptr; }

void ScannerSettings::set(const Parameter& wanted) {
  const std::lock_guard lock(mutex_);
  ScannerArguments changed = arguments_;
  const ScannerOption& option = *find_scanner_option(wanted.name);
  refuse_files(option);
  const std::string name(option.name);
  if (const auto text = text_of(wanted)) {
    ScannerOptions tried;
    set_scanner_option(tried, name, *text);
    changed.given[name] = *text;
  } else {
    changed.given.erase(name);
  }
  if (source_) make_scanner(setup(changed, *source_, {}));
  arguments_ = std::move(changed);
}

}  // namespace striper::program
