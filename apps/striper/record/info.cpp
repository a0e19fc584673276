// SPDX-License-Identifier: Apache-2.0
// striper info: what is in a recording or a table of scans, and whether it is whole.
#include <chrono>
#include <string>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <striper/stream/recording_info.hpp>

#include "program/program.hpp"
#include "program/terminal.hpp"
#include "record/info_json.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct InfoArguments {
  std::string file;
  bool json = false;
};

constexpr const char* kDescription =
    "Tell what is in a recording or a table of scans, and whether it is whole.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper info run.mcap\n"
    "      heads, topics with their rates and largest gaps, frames, scans, the model\n"
    "  striper info run.mcap --json | jq .damage\n"
    "      null where the file is whole\n\n"
    "The file is read from end to end, every checksum with it. Exit code 1 where it is damaged:\n"
    "'striper convert FILE -o WHOLE' saves what is left.";

void define(Command& command, InfoArguments& arguments) {
  command.add_option("FILE", arguments.file, "A recording (.mcap) or scans (.csv, .jsonl)")
      ->required();
  command.add_flag("--json", arguments.json, "The same for programs");
  command.footer(kExamples);
}

std::string size_text(std::uint64_t bytes) {
  if (bytes < 10'000) return count(bytes, "byte");
  const bool is_large = bytes >= 10'000'000;
  return fmt::format("{:.1f} {}", static_cast<double>(bytes) / (is_large ? 1e6 : 1e3),
                     is_large ? "MB" : "kB");
}

// Clocks that began before 2001 count from when the machine, or the stream, began.
std::string start_text(double start_s) {
  constexpr double kSince2001_s = 978'307'200.0;
  if (start_s < kSince2001_s) return fmt::format("from {:.3f} s on its clock", start_s);
  const auto whole_s = static_cast<std::time_t>(start_s);
  return fmt::format("from {:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(whole_s));
}

void print_topics(const RecordingInfo& info) {
  std::size_t widest = 5;
  for (const TopicInfo& topic : info.topics) widest = std::max(widest, topic.name.size());
  fmt::print("{:{}}  {:34} {:>9} {:>9} {:>13}\n", "topic", widest, "type", "count", "a second",
             "largest gap");
  for (const TopicInfo& topic : info.topics) {
    fmt::print("{:{}}  {:34} {:>9} {:>9.2f} {:>11.4f} s\n", topic.name, widest, topic.type,
               topic.count, topic.rate_hz(), topic.largest_gap_s);
  }
}

void print_info(const RecordingInfo& info, const std::string& file) {
  fmt::print("{}: {}, {}", file, info.format, size_text(info.bytes));
  if (info.start_s) fmt::print(", {:.3f} s {}", info.duration_s, start_text(*info.start_s));
  fmt::print("\nheads   {}\n",
             info.heads.empty() ? "none" : fmt::format("{}", fmt::join(info.heads, ", ")));
  fmt::print("frames  {}\n", info.frames);
  fmt::print("scans   {}", info.scans);
  if (!info.lasers.empty()) fmt::print(", of laser {}", fmt::join(info.lasers, ", "));
  std::vector<std::string> models;
  for (const auto& [head, attachment] : info.models) models.push_back(attachment);
  fmt::print("\nmodel   {}\n",
             models.empty() ? "none attached" : fmt::format("{}", fmt::join(models, ", ")));
  if (!info.topics.empty()) print_topics(info);
}

void say_damage(const RecordingInfo& info, const std::string& file) {
  constexpr std::size_t kMost = 5;
  for (std::size_t i = 0; i < std::min(kMost, info.damages.size()); ++i)
    say(fmt::format("damaged: {}", info.damages[i].reason));
  if (info.damages.size() > kMost)
    say(fmt::format("... and {} more places", info.damages.size() - kMost));
  if (const auto lost = info.lost_bytes())
    say(fmt::format("{} cannot be read", count(*lost, "byte")));
  say(fmt::format("save the rest: striper convert {} -o WHOLE.{}", shell_word(file), info.format));
}

ExitCode info(const InfoArguments& arguments) {
  std::optional<Progress> progress(std::in_place, "bytes", std::nullopt);
  bool is_interrupted = false;
  const RecordingInfo info = inspect_recording(arguments.file, [&](std::uint64_t bytes) {
    is_interrupted = !progress->go_on(bytes);
    return !is_interrupted;
  });
  progress.reset();
  if (is_interrupted) say("interrupted: what follows is of the part that was read");
  if (arguments.json)
    print_json(to_json(info));
  else
    print_info(info, arguments.file);
  if (info.damages.empty()) return is_interrupted ? ExitCode::kFailed : ExitCode::kDone;
  say_damage(info, arguments.file);
  return ExitCode::kFailed;
}

}  // namespace

void add_info(Command& striper, Action& action) {
  add_command<InfoArguments>(striper, action, "info", kDescription, define, info);
}

}  // namespace striper::program
