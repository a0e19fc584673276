// SPDX-License-Identifier: Apache-2.0
// striper board: a printable calibration target.
#include <cstdio>
#include <string>

#include <fmt/format.h>

#include <striper/board/board.hpp>
#include <striper/core/atomic_file.hpp>
#include <striper/core/error.hpp>

#include "program.hpp"
#include "terminal.hpp"

namespace striper::program {
namespace {

struct BoardArguments {
  std::string size = "8x6";
  double square_m = 0.040;
  std::string output = "-";
};

constexpr const char* kDescription =
    "Print a target: a checkerboard or circles as SVG, true to scale.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper board --size 8x6 --square 0.040 -o board.svg\n"
    "      9 x 7 squares of 40 mm: 8 x 6 inner corners, which is how boards are counted\n"
    "  striper board --size circles:7x7 --square 0.030 -o circles.svg\n\n"
    "Print at 100 % (no fitting to the page), measure the ruler on the print, and glue it to\n"
    "something flat. One side of the size odd and the other even lets the ends be told apart.";

void define(CLI::App& command, BoardArguments& arguments) {
  command.add_option("--size", arguments.size, "Inner corners, columns x rows, or circles:7x7")
      ->type_name("SIZE")
      ->capture_default_str();
  command.add_option("--square", arguments.square_m, "Side of a square (or spacing), metres")
      ->type_name("M")
      ->check(above_zero())
      ->capture_default_str();
  command.add_option("-o,--output", arguments.output, "The SVG; '-' is the standard output")
      ->type_name("FILE");
  command.footer(kExamples);
}

ExitCode write_board(const BoardArguments& arguments) {
  const std::string svg = board_svg(parse_board(arguments.size, arguments.square_m));
  if (arguments.output == "-") {
    if (std::fwrite(svg.data(), 1, svg.size(), stdout) != svg.size() || std::fflush(stdout) != 0)
      throw Error(ErrorKind::kIo, "the standard output could not be written");
    return ExitCode::kDone;
  }
  write_file_atomically(arguments.output, svg);
  say(fmt::format("wrote {}; print it at 100 % and measure its ruler", arguments.output));
  return ExitCode::kDone;
}

}  // namespace

void add_board(CLI::App& striper, Action& action) {
  add_command<BoardArguments>(striper, action, "board", kDescription, define, write_board);
}

}  // namespace striper::program
