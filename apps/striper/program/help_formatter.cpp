// SPDX-License-Identifier: Apache-2.0
#include "program/help_formatter.hpp"

#include <algorithm>
#include <sstream>

namespace striper::program {
namespace {

constexpr std::size_t kWidth = 96;

// "  name      text that goes on", with further lines under the text.
std::string lay_out(const std::string& name, const std::string& text, std::size_t column) {
  std::string result = "  " + name;
  std::size_t at = result.size();
  const auto begin_line = [&] {
    result += '\n' + std::string(column, ' ');
    at = column;
  };
  if (at + 2 > column) {
    begin_line();
  } else {
    result.append(column - at, ' ');
    at = column;
  }
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (at > column && at + 1 + word.size() > kWidth) begin_line();
    if (at > column) {
      result += ' ';
      ++at;
    }
    result += word;
    at += word.size();
  }
  return result + '\n';
}

}  // namespace

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  // CLI11 writes defaults into the names, as --laser INT=0 and --force{false}.
  std::string name = make_option_name(option, is_positional);
  name.resize(std::min(name.find('{'), name.size()));
  std::string opts = is_positional ? "" : make_option_opts(option);
  std::string description = make_option_desc(option);
  if (const std::string value = option->get_default_str(); !value.empty()) {
    const std::size_t at = opts.find('=' + value);
    if (at != std::string::npos) opts.erase(at, 1 + value.size());
    description += "; default " + value;
  }
  return lay_out(name + opts, description, kColumn);
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return lay_out(command->get_name(), command->get_description(), kColumn);
}

std::string HelpFormatter::make_footer(const CLI::App* app) const {
  const std::string footer = app->get_footer();
  return footer.empty() ? footer : '\n' + footer + '\n';
}

}  // namespace striper::program
