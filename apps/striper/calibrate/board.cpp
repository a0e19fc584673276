// SPDX-License-Identifier: Apache-2.0
// striper board: a printable calibration target.
#include <algorithm>
#include <cstdio>
#include <iterator>
#include <optional>
#include <string>

#include <fmt/format.h>

#include <striper/board/board.hpp>
#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>

#include "program/plot_file.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"

namespace striper::program {
namespace {

constexpr double kUsualSquare_m = 0.040;

struct BoardArguments {
  std::string size = "8x6";
  std::optional<double> square_m;
  std::optional<std::string> paper;
  std::string output = "-";
};

constexpr const char* kDescription =
    "Print a target: a checkerboard or circles as SVG, true to scale.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper board --size 8x6 --square 0.040 -o board.svg\n"
    "      9 x 7 squares of 40 mm: 8 x 6 inner corners, which is how boards are counted\n"
    "  striper board --size circles:7x7 --square 0.030 -o circles.svg\n"
    "  striper board --size 9x6 --paper a4 -o board.svg\n"
    "      the largest squares that fit the paper, to half a millimetre\n\n"
    "Print at 100 % (no fitting to the page), measure the ruler on the print, and glue it to\n"
    "something flat. One side of the size odd and the other even lets the ends be told apart.";

void define(Command& command, BoardArguments& arguments) {
  command.add_option("--size", arguments.size, "Inner corners, columns x rows, or circles:7x7")
      ->type_name("SIZE")
      ->capture_default_str();
  command.add_option("--square", arguments.square_m, "Side of a square (or spacing), metres")
      ->type_name("M")
      ->check(above_zero())
      ->default_str(fmt::format("{:g}", kUsualSquare_m));
  command
      .add_option("--paper", arguments.paper,
                  "a4, a3 or letter: as large as fits, or with --square whether it does")
      ->type_name("SIZE")
      ->check(one_of({"a4", "a3", "letter"}));
  command.add_option("-o,--output", arguments.output, "The SVG; '-' is the standard output")
      ->type_name("FILE");
  command.footer(kExamples);
}

struct Paper {
  const char* name;
  double width_mm;
  double height_mm;
};

// ISO 216 and ANSI/ASME Y14.1, from small to large.
constexpr Paper kPapers[] = {{"letter", 215.9, 279.4}, {"a4", 210.0, 297.0}, {"a3", 297.0, 420.0},
                             {"a2", 420.0, 594.0},     {"a1", 594.0, 841.0}, {"a0", 841.0, 1189.0}};

const Paper& paper_of(const std::string& name) {
  return *std::find_if(std::begin(kPapers), std::end(kPapers),
                       [&](const Paper& paper) { return name == paper.name; });
}

// Upright or lying.
bool fits(const Eigen::Vector2d& sheet_mm, const Paper& paper) {
  return sheet_mm.maxCoeff() <= paper.height_mm && sheet_mm.minCoeff() <= paper.width_mm;
}

Eigen::Vector2d sheet_mm(const std::string& size, double square_m) {
  return 1000.0 * board_sheet_m(parse_board(size, square_m));
}

// The largest square with which a board fits a paper, in steps of half a millimetre; 0 for none.
double largest_square_m(const std::string& size, const Paper& paper) {
  constexpr double kStep_m = 0.0005;
  int steps = 0;
  while (fits(sheet_mm(size, kStep_m * (steps + 1)), paper)) ++steps;
  return kStep_m * steps;
}

double square_that_fits(const BoardArguments& arguments) {
  if (!arguments.paper) return arguments.square_m.value_or(kUsualSquare_m);
  const Paper& paper = paper_of(*arguments.paper);
  const double largest_m = largest_square_m(arguments.size, paper);
  if (!(largest_m > 0.0)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("a board of {} does not fit {} paper with any square", arguments.size,
                            paper.name));
  }
  if (!arguments.square_m) return largest_m;
  const Eigen::Vector2d sheet = sheet_mm(arguments.size, *arguments.square_m);
  if (fits(sheet, paper)) return *arguments.square_m;
  throw Error(ErrorKind::kUsage,
              fmt::format("--square {:g}: the sheet is {:.0f} x {:.0f} mm and {} paper {:g} x {:g} "
                          "mm; --square {:g} is the largest that fits",
                          *arguments.square_m, sheet.x(), sheet.y(), paper.name, paper.width_mm,
                          paper.height_mm, largest_m));
}

// What to print it on.
std::string paper_needed(const BoardArguments& arguments, const Eigen::Vector2d& sheet) {
  if (arguments.paper) return *arguments.paper;
  const auto* const paper = std::find_if(std::begin(kPapers), std::end(kPapers),
                                         [&](const Paper& one) { return fits(sheet, one); });
  return paper == std::end(kPapers) ? "larger than a0" : std::string(paper->name);
}

ExitCode write_board(const BoardArguments& arguments) {
  if (arguments.output != "-") require_plot_file("--output", arguments.output);
  const Board board = parse_board(arguments.size, square_that_fits(arguments));
  const std::string svg = board_svg(board);
  if (arguments.output == "-") {
    if (std::fwrite(svg.data(), 1, svg.size(), stdout) != svg.size() || std::fflush(stdout) != 0)
      throw Error(ErrorKind::kIo, "the standard output could not be written");
  } else {
    write_file_atomically(arguments.output, svg);
    say(fmt::format("wrote {}; print it at 100 % and measure its ruler", arguments.output));
  }
  const Eigen::Vector2d sheet = 1000.0 * board_sheet_m(board);
  say(fmt::format("{} of {:g} mm; the sheet is {:.0f} x {:.0f} mm: paper {}", to_string(board),
                  1000.0 * board.square_m, sheet.x(), sheet.y(), paper_needed(arguments, sheet)));
  return ExitCode::kDone;
}

}  // namespace

void add_board(Command& striper, Action& action) {
  add_command<BoardArguments>(striper, action, "board", kDescription, define, write_board);
}

}  // namespace striper::program
