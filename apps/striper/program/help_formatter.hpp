// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace striper::program {

/// Lays out `--help` for a terminal: descriptions are wrapped beside their option.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() { column_width(kColumn); }

  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_footer(const CLI::App* app) const override;

 private:
  static constexpr std::size_t kColumn = 24;  ///< Where descriptions begin.
};

}  // namespace striper::program
