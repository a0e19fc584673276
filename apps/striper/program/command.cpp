// SPDX-License-Identifier: Apache-2.0
#include "program/command.hpp"

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include <CLI/CLI.hpp>

namespace striper::program {

CommandOption* CommandOption::type_name(const std::string& name) {
  option_.type_name(name);
  return this;
}

CommandOption* CommandOption::description(const std::string& text) {
  option_.description(text);
  return this;
}

CommandOption* CommandOption::required(bool is_required) {
  option_.required(is_required);
  return this;
}

CommandOption* CommandOption::check(const WordCheck& why_not) {
  CLI::Validator validator;
  validator.operation([why_not](std::string& word) { return why_not(word); });
  option_.check(validator);
  return this;
}

CommandOption* CommandOption::needs(CommandOption* other) {
  option_.needs(&other->option_);
  return this;
}

CommandOption* CommandOption::needs(const std::string& name) {
  option_.needs<CLI::App>(name);
  return this;
}

CommandOption* CommandOption::excludes(CommandOption* other) {
  option_.excludes(&other->option_);
  return this;
}

CommandOption* CommandOption::excludes(const std::string& name) {
  option_.excludes<CLI::App>(name);
  return this;
}

CommandOption* CommandOption::capture_default_str() {
  option_.capture_default_str();
  return this;
}

CommandOption* CommandOption::default_str(const std::string& words) {
  option_.default_str(words);
  return this;
}

CommandOption* CommandOption::one_word_each() {
  option_.allow_extra_args(false);
  return this;
}

CommandOption* CommandOption::word_or_none() {
  option_.expected(0, 1);
  return this;
}

CommandOption* CommandOption::take_all() {
  option_.take_all();
  return this;
}

struct Command::Parts {
  std::deque<Command> commands;
  std::deque<CommandOption> options;
};

Command::Command(CLI::App& app) : app_(app), parts_(std::make_unique<Parts>()) {}
Command::~Command() = default;

Command& Command::add_subcommand(const std::string& name, const std::string& description) {
  return parts_->commands.emplace_back(*app_.add_subcommand(name, description));
}

void Command::require_subcommand() { app_.require_subcommand(1); }
void Command::callback(const std::function<void()>& chosen) { app_.callback(chosen); }
void Command::footer(const std::string& text) { app_.footer(text); }

CommandOption* Command::own(CLI::Option* option) { return &parts_->options.emplace_back(*option); }

template <typename Value>
CommandOption* Command::add_option(const std::string& names, Value& value,
                                   const std::string& help) {
  return own(app_.add_option(names, value, help));
}

CommandOption* Command::add_flag(const std::string& names, bool& value, const std::string& help) {
  return own(app_.add_flag(names, value, help));
}

CommandOption* Command::add_word(const std::string& names,
                                 const std::function<void(const std::string&)>& keep,
                                 const std::string& help) {
  return own(app_.add_option_function<std::string>(names, keep, help));
}

CommandOption* Command::get_option(const std::string& name) { return own(app_.get_option(name)); }

// What an argument may be.
// NOLINTBEGIN(bugprone-macro-parentheses): a type has none.
#define STRIPER_ARGUMENT(Value) \
  template CommandOption* Command::add_option(const std::string&, Value&, const std::string&)
STRIPER_ARGUMENT(std::string);
STRIPER_ARGUMENT(double);
STRIPER_ARGUMENT(int);
STRIPER_ARGUMENT(std::uint64_t);
STRIPER_ARGUMENT(std::optional<std::string>);
STRIPER_ARGUMENT(std::optional<double>);
STRIPER_ARGUMENT(std::optional<int>);
STRIPER_ARGUMENT(std::optional<std::uint64_t>);
STRIPER_ARGUMENT(std::vector<std::string>);
STRIPER_ARGUMENT(std::vector<double>);
STRIPER_ARGUMENT(std::vector<int>);
STRIPER_ARGUMENT(std::vector<std::vector<std::string>>);
#undef STRIPER_ARGUMENT
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace striper::program
