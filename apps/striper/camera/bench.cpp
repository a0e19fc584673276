// SPDX-License-Identifier: Apache-2.0
// striper bench: how fast this machine finds the stripe.
#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>

#include "bench/speed_table.hpp"
#include "bench/speed_text.hpp"
#include "options/option_bounds.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct BenchArguments {
  std::vector<std::string> sizes{"640x480", "2048x1088", "4096x3000"};
  std::vector<int> bits{8};
  int memory_mb = 400;
  bool quick = false;
  bool json = false;
};

constexpr const char* kDescription =
    "Measure how fast this machine finds the stripe, beside reading the image and OpenCV.";

constexpr const char* kFooter =
    "Examples:\n"
    "  striper bench --size 640x480\n"
    "      is the camera's rate within reach?\n"
    "  striper bench --bits 8 16 --json > bench.json\n\n"
    "One core. Hot: the same image again and again; stream: images from memory. Roof: the "
    "time\n"
    "of only reading the image over the row's own, measured in turn, which a clock that changes\n"
    "leaves alone. All are medians of 5 to 31 runs. Rows of one table can be compared, on a quiet\n"
    "machine.";

void define(Command& command, BenchArguments& arguments) {
  command.add_option("--size", arguments.sizes, "Images of this size, one or more")
      ->type_name("WxH")
      ->capture_default_str();
  command.add_option("--bits", arguments.bits, "Bits of a pixel: 8, or 16 (12 of them used)")
      ->type_name("N")
      ->check(one_of({"8", "16"}))
      ->capture_default_str();
  command.add_option("--memory", arguments.memory_mb, "Memory for the streamed images")
      ->type_name("MB")
      ->check(between(1, 100000))
      ->capture_default_str();
  command.add_flag("--quick", arguments.quick, "Rough figures in a tenth of the time");
  command.add_flag("--json", arguments.json, "The tables for programs on the standard output");
  command.footer(kFooter);
}

cv::Size size_of(const std::string& text) {
  constexpr int kLeast = 64;
  constexpr int kMost = 16384;
  int width = 0;
  int height = 0;
  char rest = 0;
  const bool is_size = std::sscanf(text.c_str(), "%5dx%5d%c", &width, &height, &rest) == 2;
  const auto fits = [](int n) { return n >= kLeast && n <= kMost; };
  if (is_size && fits(width) && fits(height)) return {width, height};
  throw Error(ErrorKind::kUsage,
              fmt::format("--size {}: expected WIDTHxHEIGHT, each {} to {}, as in 640x480", text,
                          kLeast, kMost));
}

ExitCode bench(const BenchArguments& arguments) {
  std::vector<cv::Size> sizes;
  for (const std::string& size : arguments.sizes) sizes.push_back(size_of(size));
  speed::SpeedOptions options;
  options.ring_bytes = static_cast<std::size_t>(arguments.memory_mb) << 20;
  if (arguments.quick) options.seconds_per_row *= 0.1;

  options.should_stop = stop_requested;

  nlohmann::json tables = nlohmann::json::array();
  if (!arguments.json) fmt::print("instruction set: {}\n", speed::instruction_set());
  try {
    for (const int bits : arguments.bits) {
      for (const cv::Size& size : sizes) {
        const speed::SpeedTable table = speed::measure_speed(size, bits, options);
        tables.push_back(speed::to_json(table));
        if (arguments.json) continue;
        fmt::print("\n{}", speed::to_text(table));
        std::fflush(stdout);
      }
    }
  } catch (const speed::Stopped&) {
    say(fmt::format("interrupted after {}", count(tables.size(), "table")));
  }
  if (arguments.json) {
    print_json({{"instruction_set", speed::instruction_set()}, {"tables", std::move(tables)}});
  }
  return ExitCode::kDone;
}

}  // namespace

void add_bench(Command& striper, Action& action) {
  add_command<BenchArguments>(striper, action, "bench", kDescription, define, bench);
}

}  // namespace striper::program
