// SPDX-License-Identifier: Apache-2.0
// striper doctor: what is wrong with a source, and what to do about it.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/gige/gige_network.hpp>
#include <striper/gige/gige_source.hpp>

#include "camera_commands.hpp"
#include "frame_loop.hpp"
#include "program.hpp"
#include "summary.hpp"
#include "terminal.hpp"

namespace striper::program {
namespace {

using Severity = Diagnosis::Severity;

struct DoctorArguments {
  std::string source;
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
    "  striper doctor images:shots\n\n"
    "Exit code 0 where all is well or only doubtful, 1 where something is bad.";

void define(CLI::App& command, DoctorArguments& arguments) {
  add_source(command, arguments.source);
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

/// What a few pictures show of light, laser and focus. Written for people in front of a camera:
/// simple measures with wide limits.
class PictureExam {
 public:
  void look_at(const Frame& frame) {
    if (frame.status != FrameStatus::kOk || frame.illumination.is_dark()) return;
    if (frame.image.channels() != 1) return;
    ++pictures_;
    full_scale_ = frame.full_scale_dn();
    for (int u = 0; u < frame.image.cols; u += kEvery) look_at_column(frame.image, u);
  }

  void conclude(std::vector<Diagnosis>& findings) const {
    if (pictures_ == 0 || columns_ == 0) return;
    const double saturated = static_cast<double>(saturated_) / static_cast<double>(pixels_);
    const double striped = static_cast<double>(widths_.size()) / columns_;
    if (saturated > 0.02) {
      findings.push_back({Severity::kBad,
                          fmt::format("{:.0f} % of the pixels are saturated", 100.0 * saturated),
                          "exposure too long or too much daylight: shorten exposure_us, close the "
                          "iris, fit the band-pass filter"});
    }
    if (striped < 0.05) {
      conclude_without_stripe(findings, saturated);
      return;
    }
    findings.push_back(
        {Severity::kGood, fmt::format("a stripe in {:.0f} % of the columns", 100.0 * striped), ""});
    const double height = median(heights_) / full_scale_;
    if (height < kFaint) {
      findings.push_back(
          {Severity::kDoubtful,
           fmt::format("the stripe is faint: {:.0f} % of full scale", 100.0 * height),
           "exposure too short for this laser: lengthen exposure_us (not beyond its pulse), open "
           "the iris, or raise gain"});
    }
    const double width_px = median(widths_);
    if (width_px > 8.0) {
      findings.push_back(
          {Severity::kDoubtful,
           fmt::format("the stripe is {:.1f} pixels wide at half its height", width_px),
           "out of focus: turn the lens' ring until it is 2 to 4, then lock it; or "
           "the laser's own focus"});
    }
    const double clipped =
        static_cast<double>(clipped_peaks_) / static_cast<double>(widths_.size());
    if (clipped > 0.5 && saturated <= 0.02) {
      findings.push_back(
          {Severity::kDoubtful,
           fmt::format("the stripe is saturated in {:.0f} % of its columns", 100.0 * clipped),
           "fine for ranges while it is narrow; shorten exposure_us to see less of "
           "the surroundings"});
    }
  }

 private:
  static constexpr int kEvery = 4;
  static constexpr double kFaint = 0.1;

  static double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }

  void look_at_column(const cv::Mat& image, int u) {
    column_.resize(static_cast<std::size_t>(image.rows));
    for (int v = 0; v < image.rows; ++v) {
      column_[static_cast<std::size_t>(v)] =
          image.depth() == CV_8U ? image.at<std::uint8_t>(v, u) : image.at<std::uint16_t>(v, u);
    }
    ++columns_;
    pixels_ += column_.size();
    const auto saturated = [&](auto from, auto to) {
      return static_cast<std::size_t>(
          std::count_if(from, to, [&](double value) { return value >= full_scale_; }));
    };
    saturated_ += saturated(column_.begin(), column_.end());
    const double level = median(column_);
    deviations_ = column_;
    for (double& value : deviations_) value = std::abs(value - level);
    const double noise = 1.4826 * median(deviations_) + 0.3 * full_scale_ / 255.0;
    const auto peak = std::max_element(column_.begin(), column_.end());
    brightest_ = std::max(brightest_, *peak);
    levels_ += level;
    if (*peak - level < 8.0 * noise) return;
    if (*peak >= full_scale_) ++clipped_peaks_;
    const double half = 0.5 * (*peak + level);
    auto first = peak;
    auto last = peak;
    while (first != column_.begin() && *std::prev(first) > half) --first;
    while (std::next(last) != column_.end() && *std::next(last) > half) ++last;
    saturated_ -= saturated(first, std::next(last));  // the stripe's own are told of apart
    heights_.push_back(*peak - level);
    widths_.push_back(static_cast<double>(std::distance(first, last) + 1));
  }

  void conclude_without_stripe(std::vector<Diagnosis>& findings, double saturated) const {
    if (saturated > 0.02) return;
    if (brightest_ < 0.1 * full_scale_) {
      findings.push_back({Severity::kBad,
                          fmt::format("the pictures are dark: the brightest pixel is {:.0f} of {}",
                                      brightest_, full_scale_),
                          "exposure too short, lens cap on, or laser off: lengthen exposure_us, "
                          "raise gain, check the laser's supply and strobe="});
    } else {
      findings.push_back({Severity::kBad,
                          fmt::format("no stripe; the surroundings are at {:.0f} of {}",
                                      levels_ / columns_, full_scale_),
                          "laser off or out of view: check its supply, interlock and strobe= line; "
                          "does it fire during the exposure?"});
    }
  }

  int pictures_ = 0;
  int full_scale_ = 255;
  int columns_ = 0;
  std::size_t pixels_ = 0;
  std::size_t saturated_ = 0;
  std::size_t clipped_peaks_ = 0;
  double brightest_ = 0.0;
  double levels_ = 0.0;
  std::vector<double> widths_;
  std::vector<double> heights_;
  std::vector<double> column_;
  std::vector<double> deviations_;
};

void conclude_stream(const FrameLoopResult& result, const SourceInfo& info,
                     std::vector<Diagnosis>& findings) {
  const SourceStatistics& got = result.statistics;
  findings.push_back({Severity::kGood, "read " + describe(result), ""});
  if (got.dropped + got.incomplete > 0) {
    findings.push_back({Severity::kBad,
                        fmt::format("pictures lost on the way: {} never came, {} incomplete",
                                    got.dropped, got.incomplete),
                        info.uri.starts_with("gige:")
                            ? "larger socket buffer (`sysctl -w net.core.rmem_max=33554432`), "
                              "jumbo frames, packet_delay_us=, a better cable or switch"
                            : "a slower rate, or a faster bus"});
  }
  if (got.overrun > 0) {
    findings.push_back({Severity::kDoubtful,
                        fmt::format("{} pictures came faster than they were read", got.overrun),
                        "a lower fps, a region of interest, or a faster machine"});
  }
  if (got.corrupt + got.wrong_size > 0) {
    findings.push_back(
        {Severity::kBad,
         fmt::format("{} damaged pictures, {} of a wrong size", got.corrupt, got.wrong_size),
         "cable, connector, or a damaged file"});
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
  PictureExam pictures;
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
  } catch (const NoPicture& failure) {
    const int packet_bytes = network().packet_bytes;
    source.reset();  // the camera is asked by somebody else
    conclude_silence(failure, SourceUri::parse(arguments.source), packet_bytes, findings);
  }
}

std::vector<Diagnosis> examine(const DoctorArguments& arguments) {
  std::vector<Diagnosis> findings;
  try {
    const SourceUri uri = SourceUri::parse(arguments.source);
    if (uri.scheme() == "gige") findings = examine_gige_network(uri.path());
    if (!any_bad(findings)) watch(arguments, findings);
  } catch (const Error& failure) {
    if (failure.kind() == ErrorKind::kUsage) throw;
    findings.push_back({Severity::kBad, failure.what(), ""});
  }
  return findings;
}

ExitCode doctor(const DoctorArguments& arguments) {
  const std::vector<Diagnosis> findings = examine(arguments);
  nlohmann::json list = nlohmann::json::array();
  for (const Diagnosis& one : findings) {
    list.push_back({{"severity", word(one.severity)}, {"what", one.what}, {"cure", one.cure}});
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
