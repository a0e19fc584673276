// SPDX-License-Identifier: Apache-2.0
// striper doctor: what is wrong with a source, and what to do about it.
#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/stream/sink_plugin.hpp>

#include "camera/doctor_network.hpp"
#include "camera/picture_exam.hpp"
#include "camera/stream_exam.hpp"
#include "options/scanner_arguments.hpp"
#include "program/commands.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/frame_loop.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct DoctorArguments {
  std::string source;
  std::string ros2;  // A sink's address; empty: not asked for.
  ScannerArguments scanner;
  double seconds = 3.0;
  bool json = false;
};

constexpr const char* kDescription =
    "Doctor: looks at a camera, its network and its images, and says what to do.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper doctor gige:\n"
    "      the first camera that answers, or why none does\n"
    "  striper doctor 'gige:STRIPER1?exposure_us=20&strobe=Line2'\n"
    "      the frames as they will be captured: exposure, laser, focus\n"
    "  striper doctor 'images:shots?laser=0,dark' --model striper.yaml\n"
    "      images that were taken, scanned as they will be\n"
    "  striper doctor --ros2\n"
    "      who is heard of ROS 2 programs, and why those do not hear a head\n\n"
    "Exit code 0 where all is well or only doubtful, 1 where something is bad.";

void define(Command& command, DoctorArguments& arguments) {
  CommandOption* source = add_source(command, arguments.source)->required(false);
  command
      .add_option("--ros2", arguments.ros2,
                  "What keeps ROS 2 programs from hearing the scans, and who is heard; as --to "
                  "would say it: ros2:?interface=eth0")
      ->type_name("[ros2:...]")
      ->word_or_none()
      ->default_str("ros2:")
      ->excludes(source);
  add_scanner_arguments(command, arguments.scanner);
  command.add_option("--seconds", arguments.seconds, "How long to watch; default 3")
      ->type_name("S")
      ->check(above_zero());
  command.add_flag("--json", arguments.json, "The findings for programs on the standard output");
  command.footer(kExamples);
}

const char* word(Severity severity) {
  switch (severity) {
    case Severity::kRefusal:
    case Severity::kError:
      return "bad";
    case Severity::kWarning:
      return "doubtful";
    case Severity::kInfo:
      break;
  }
  return "good";
}

// What the library warned of (drivers, fields, the illumination pattern), each once; none of it by
// itself is worse than doubtful.
void conclude_warnings(const std::vector<Event>& heard, std::vector<Event>& findings) {
  const auto first = static_cast<std::ptrdiff_t>(findings.size());
  for (const Event& one : heard) {
    const auto is_same = [&](const Event& other) {
      return other.code == one.code && other.message == one.message;
    };
    const bool is_new = std::none_of(findings.begin() + first, findings.end(), is_same);
    const bool is_in_sum = one.code == EventCode("frames_dropped");  // By `conclude_stream`.
    if (one.severity < Severity::kWarning || !is_new || is_in_sum) continue;
    findings.push_back(one);
    findings.back().severity = Severity::kWarning;
  }
}

bool any_bad(const std::vector<Event>& findings) { return worst(findings) >= Severity::kError; }

void conclude_silence(const NoFrame& failure, const SourceUri& uri, int packet_bytes,
                      std::vector<Event>& findings) {
  findings.push_back({Severity::kError, "source_silent", failure.what()});
  std::vector<Event> causes = examine_silence(uri, packet_bytes);
  if (causes.empty()) {
    findings.back().advice = "is it switched on, does it wait for a trigger, is there a signal?";
  }
  for (Event& one : causes) findings.push_back(std::move(one));
}

void watch(const DoctorArguments& arguments, const EventPort& events,
           std::vector<Event>& findings) {
  auto source = open_source(arguments.source, events);
  const SourceInfo info = source->info();
  findings.push_back({"source_opened", "opened: " + info.description});
  ImageExam images(scanner_setup(arguments.scanner, info, events));
  FrameLimits limits;
  limits.seconds = arguments.seconds;
  try {
    const FrameReport result = read_frames(*source, limits, TerminalEvents().port(),
                                           [&](const Frame& frame) { images.look_at(frame); });
    findings.push_back({"source_ended", "read " + describe(result)});
    conclude_stream(result, info, findings);
    conclude_network(*source, findings);
    images.conclude(findings);
    let_go(std::move(source), result);
  } catch (const NoFrame& failure) {
    const int packet_bytes = packet_bytes_of(*source);
    source.reset();  // The camera is asked by somebody else.
    conclude_silence(failure, SourceUri::parse(arguments.source), packet_bytes, findings);
  }
}

std::vector<Event> examine_ros2(const DoctorArguments& arguments) {
  const auto watch = std::chrono::duration<double>(arguments.seconds);
  return examine_sink(arguments.ros2, std::chrono::duration_cast<std::chrono::milliseconds>(watch));
}

std::vector<Event> examine(const DoctorArguments& arguments) {
  if (!arguments.ros2.empty()) return examine_ros2(arguments);
  if (arguments.source.empty()) throw Error(ErrorKind::kUsage, "doctor of what? SOURCE or --ros2");
  std::vector<Event> findings;
  const TerminalEvents events = TerminalEvents::silent();
  try {
    findings = examine_network(SourceUri::parse(arguments.source));
    if (!any_bad(findings)) watch(arguments, events.port(), findings);
  } catch (const Error& failure) {
    if (failure.kind() == ErrorKind::kUsage) throw;
    findings.push_back({Severity::kError, "source_not_open", failure.what()});
  }
  conclude_warnings(events.heard(), findings);
  return findings;
}

ExitCode doctor(const DoctorArguments& arguments) {
  const std::vector<Event> findings = examine(arguments);
  nlohmann::json list = nlohmann::json::array();
  for (const Event& one : findings) {
    list.push_back({{"severity", word(one.severity)},
                    {"code", one.code.word()},
                    {"what", one.message},
                    {"cure", one.advice}});
    if (arguments.json) continue;
    fmt::print("{:<9} {}\n", word(one.severity), one.message);
    if (!one.advice.empty()) fmt::print("{:<9} -> {}\n", "", one.advice);
  }
  if (arguments.json) {
    const std::string& of = arguments.ros2.empty() ? arguments.source : arguments.ros2;
    print_json({{"source", of}, {"findings", list}});
  }
  return any_bad(findings) ? ExitCode::kFailed : ExitCode::kDone;
}

}  // namespace

void add_doctor(Command& striper, Action& action) {
  add_command<DoctorArguments>(striper, action, "doctor", kDescription, define, doctor);
}

}  // namespace striper::program
