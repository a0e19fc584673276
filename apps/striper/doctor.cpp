// SPDX-License-Identifier: Apache-2.0
// striper doctor: what is wrong with a source, and what to do about it.
#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/core/log.hpp>
#include <striper/gige/gige_network.hpp>
#include <striper/gige/gige_source.hpp>

#include "camera_commands.hpp"
#include "frame_loop.hpp"
#include "picture_exam.hpp"
#include "program.hpp"
#include "scanner_arguments.hpp"
#include "summary.hpp"
#include "terminal.hpp"

namespace striper::program {
namespace {

using Severity = Diagnosis::Severity;

struct DoctorArguments {
  std::string source;
  ScannerArguments scanner;
  double seconds = 3.0;
  bool json = false;
};

constexpr const char* kDescription =
    "Doctor: looks at a camera, its network and its pictures, and says what to do.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper doctor gige:\n"
    "      the first camera that answers, or why none does\n"
    "  striper doctor 'gige:STRIPER1?exposure_us=20&strobe=Line2'\n"
    "      the pictures as they will be captured: exposure, laser, focus\n"
    "  striper doctor 'images:shots?laser=0,dark' --model striper.yaml\n"
    "      pictures that were taken, scanned as they will be\n\n"
    "Exit code 0 where all is well or only doubtful, 1 where something is bad.";

void define(CLI::App& command, DoctorArguments& arguments) {
  add_source(command, arguments.source);
  add_scanner_arguments(command, arguments.scanner);
  command.add_option("--seconds", arguments.seconds, "How long to watch; default 3")
      ->type_name("S")
      ->check(above_zero());
  command.add_flag("--json", arguments.json, "The findings for programs on the standard output");
  command.footer(kExamples);
}

const char* word(Severity severity) {
  switch (severity) {
    case Severity::kBad:
      return "bad";
    case Severity::kDoubtful:
      return "doubtful";
    case Severity::kGood:
      break;
  }
  return "good";
}

/// Hears what the library warns of (drivers, fields, the laser's cadence), instead of the terminal.
class HeardWarnings {
 public:
  HeardWarnings() {
    set_log_callback([this](LogLevel level, std::string_view message) {
      if (level >= LogLevel::kWarning) note(std::string(message));
    });
  }
  HeardWarnings(const HeardWarnings&) = delete;
  HeardWarnings& operator=(const HeardWarnings&) = delete;
  ~HeardWarnings() { set_log_callback({}); }

  /// Hears no more. @param findings gets each once.
  void conclude(std::vector<Diagnosis>& findings) {
    set_log_callback({});
    for (std::string& one : messages_)
      findings.push_back({Severity::kDoubtful, std::move(one), ""});
  }

 private:
  void note(std::string message) {
    const bool is_known = std::find(messages_.begin(), messages_.end(), message) != messages_.end();
    if (!is_known) messages_.push_back(std::move(message));
  }

  std::vector<std::string> messages_;
};

void conclude_stream(const FrameLoopResult& result, const SourceInfo& info,
                     std::vector<Diagnosis>& findings) {
  const SourceStatistics& got = result.statistics;
  findings.push_back({Severity::kGood, "read " + describe(result), ""});
  if (got.dropped > 0 && !info.is_live) {
    findings.push_back(
        {Severity::kDoubtful,
         fmt::format("{} missing between the pictures' numbers", count(got.dropped, "number")),
         "each counts as a lost picture, over which the laser's cadence goes on; where the numbers "
         "are no count of pictures, give names that are"});
  }
  if (info.is_live && got.dropped + got.incomplete > 0) {
    findings.push_back({Severity::kBad,
                        fmt::format("pictures lost on the way: {} never came, {} incomplete",
                                    got.dropped, got.incomplete),
                        info.uri.starts_with("gige:")
                            ? "larger socket buffer (`sysctl -w net.core.rmem_max=33554432`), "
                              "jumbo frames, packet_delay_us=, a better cable or switch; a "
                              "real-time stream thread (`setcap cap_sys_nice+ep` on this program)"
                            : "a slower rate, or a faster bus"});
  }
  if (result.is_lost) {
    findings.push_back({Severity::kBad, "the camera was lost, and is not to be opened again",
                        "cable, connector, power supply; without reconnect=no it is waited for"});
  }
  if (got.reconnects > 0) {
    findings.push_back({Severity::kBad,
                        fmt::format("lost and opened again {}", count(got.reconnects, "time")),
                        "cable, connector, power supply"});
  }
  if (got.overrun > 0) {
    findings.push_back({Severity::kDoubtful,
                        fmt::format("{} pictures came faster than they were read", got.overrun),
                        "a lower fps, a region of interest, or a faster machine"});
  }
  if (got.corrupt > 0) {
    findings.push_back({Severity::kBad, count(got.corrupt, "damaged picture"),
                        info.is_live ? "cable, connector" : "damaged files: take them out"});
  }
  if (got.wrong_size > 0) {
    findings.push_back(
        {Severity::kBad,
         count(got.wrong_size, "picture") + " of another size, colour or depth than the first",
         info.is_live ? "cable, connector" : "pictures of one camera, in one format, to a source"});
  }
}

void conclude_network(const GigeStatistics& network, std::vector<Diagnosis>& findings) {
  if (network.socket_drops > 0) {
    findings.push_back({Severity::kBad,
                        fmt::format("this machine threw {} packets away: the socket's buffer of {} "
                                    "kB was full",
                                    network.socket_drops, network.socket_buffer_bytes / 1024),
                        "`sysctl -w net.core.rmem_max=33554432`, or packet_delay_us="});
  }
  if (network.resend_requests > 0) {
    findings.push_back({Severity::kDoubtful,
                        fmt::format("{} packets were lost and asked for again, {} of them came",
                                    network.resend_requests, network.resent_packets),
                        "cable, switch, or too short a pause between packets (packet_delay_us=)"});
  }
  if (network.packet_bytes > 0 && network.packet_bytes < 1400) {
    findings.push_back({Severity::kDoubtful,
                        fmt::format("packets of {} bytes: the way is narrow", network.packet_bytes),
                        "raise the MTU of the interface and the switch"});
  }
}

void conclude_silence(const NoPicture& failure, const SourceUri& uri, int packet_bytes,
                      std::vector<Diagnosis>& findings) {
  findings.push_back({Severity::kBad, failure.what(), ""});
  if (uri.scheme() != "gige") {
    findings.back().cure = "is it switched on, does it wait for a trigger, is there a signal?";
    return;
  }
  for (Diagnosis& one : examine_gige_stream(uri.path(), packet_bytes)) {
    findings.push_back(std::move(one));
  }
}

void watch(const DoctorArguments& arguments, std::vector<Diagnosis>& findings) {
  auto source = open_source(arguments.source);
  const SourceInfo info = source->info();
  findings.push_back({Severity::kGood, "opened: " + info.description, ""});
  PictureExam pictures(scanner_setup(arguments.scanner, info));
  FrameLimits limits;
  limits.seconds = arguments.seconds;
  const auto network = [&] {
    const auto* const camera = dynamic_cast<const GigeSource*>(source.get());
    return camera != nullptr ? camera->stream_statistics() : GigeStatistics{};
  };
  try {
    const FrameLoopResult result =
        read_frames(*source, limits, [&](const Frame& frame) { pictures.look_at(frame); });
    conclude_stream(result, info, findings);
    conclude_network(network(), findings);
    pictures.conclude(findings);
    let_go(std::move(source), result);
  } catch (const NoPicture& failure) {
    const int packet_bytes = network().packet_bytes;
    source.reset();  // the camera is asked by somebody else
    conclude_silence(failure, SourceUri::parse(arguments.source), packet_bytes, findings);
  }
}

std::vector<Diagnosis> examine(const DoctorArguments& arguments) {
  std::vector<Diagnosis> findings;
  HeardWarnings warnings;
  try {
    const SourceUri uri = SourceUri::parse(arguments.source);
    if (uri.scheme() == "gige") findings = examine_gige_network(uri.path());
    if (!any_bad(findings)) watch(arguments, findings);
  } catch (const Error& failure) {
    if (failure.kind() == ErrorKind::kUsage) throw;
    findings.push_back({Severity::kBad, failure.what(), ""});
  }
  warnings.conclude(findings);
  return findings;
}

ExitCode doctor(const DoctorArguments& arguments) {
  const std::vector<Diagnosis> findings = examine(arguments);
  nlohmann::json list = nlohmann::json::array();
  for (const Diagnosis& one : findings) {
    list.push_back({{"severity", word(one.severity)},
                    {"code", one.code},
                    {"what", one.what},
                    {"cure", one.cure}});
    if (arguments.json) continue;
    fmt::print("{:<9} {}\n", word(one.severity), one.what);
    if (!one.cure.empty()) fmt::print("{:<9} -> {}\n", "", one.cure);
  }
  if (arguments.json) print_json({{"source", arguments.source}, {"findings", list}});
  return any_bad(findings) ? ExitCode::kFailed : ExitCode::kDone;
}

}  // namespace

void add_doctor(CLI::App& striper, Action& action) {
  add_command<DoctorArguments>(striper, action, "doctor", kDescription, define, doctor);
}

}  // namespace striper::program
