// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

namespace CLI {  // NOLINT: as CLI11 calls it.
class App;
class Option;
}  // namespace CLI

namespace striper::program {

// What commands say of their arguments. CLI11, of which all of it is made, is known to command.cpp,
// program.cpp, help_formatter.cpp and main.cpp alone: it takes seconds to compile wherever it is
// included.

/// Why a word cannot be an option's; empty where it can.
using WordCheck = std::function<std::string(const std::string&)>;

/// An option or a positional argument of a command, which owns it. What shapes it returns it again.
class CommandOption {
 public:
  explicit CommandOption(CLI::Option& option) : option_(option) {}

  /// What the help shows for its value: FILE.
  CommandOption* type_name(const std::string& name);
  CommandOption* description(const std::string& text);
  CommandOption* required(bool is_required = true);
  /// Every word has to pass.
  CommandOption* check(const WordCheck& why_not);

  CommandOption* needs(CommandOption* other);
  CommandOption* needs(const std::string& name);
  CommandOption* excludes(CommandOption* other);
  CommandOption* excludes(const std::string& name);

  /// The help shows the value that is there now, or these words.
  CommandOption* capture_default_str();
  CommandOption* default_str(const std::string& words);

  /// Takes one word each time that it is given, though it may be given often.
  CommandOption* one_word_each();
  /// Takes a word or none; without one its value is what `default_str` says.
  CommandOption* word_or_none();
  /// Given several times, with several words each, it has all of them.
  CommandOption* take_all();

 private:
  friend class Command;

  CLI::Option& option_;
};

/// A command of the program, or the program itself, whose arguments are put where they say.
class Command {
 public:
  explicit Command(CLI::App& app);
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  ~Command();

  Command& add_subcommand(const std::string& name, const std::string& description);
  void require_subcommand();
  /// Runs where this command was chosen, once everything is put in place.
  void callback(const std::function<void()>& chosen);
  /// What the help ends with.
  void footer(const std::string& text);

  /// @param names `-o,--output`, or a word alone for a positional argument.
  /// @param value a string, int, double or std::uint64_t, one that is optional, or a vector: the
  ///        types are listed in command.cpp.
  template <typename Value>
  CommandOption* add_option(const std::string& names, Value& value, const std::string& help);
  CommandOption* add_flag(const std::string& names, bool& value, const std::string& help);
  /// Hands each word that is given to `keep`.
  CommandOption* add_word(const std::string& names,
                          const std::function<void(const std::string&)>& keep,
                          const std::string& help);

  /// One that was added before. Precondition: there is such a one.
  CommandOption* get_option(const std::string& name);

 private:
  struct Parts;
  CommandOption* own(CLI::Option* option);

  CLI::App& app_;
  std::unique_ptr<Parts> parts_;
};

}  // namespace striper::program
