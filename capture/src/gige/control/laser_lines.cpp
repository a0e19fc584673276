// SPDX-License-Identifier: Apache-2.0
#include "gige/control/laser_lines.hpp"

#include <algorithm>
#include <charconv>
#include <exception>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>

#include "gige/control/camera_setup.hpp"

namespace striper::detail {
namespace {

/// Line2 is bit 2 of LineStatusAll (GenICam SFNC 2.7, LineStatusAll); empty where a name says none.
std::optional<int> bit_of_line(const std::string& line) {
  constexpr int kBits = 64;
  int bit = kBits;
  const std::size_t digits = std::min(line.find_first_of("0123456789"), line.size());
  std::from_chars(line.data() + digits, line.data() + line.size(), bit);
  return bit < kBits ? std::optional<int>(bit) : std::nullopt;
}

bool is_constant(const IlluminationPattern& pattern) { return pattern.entries().size() == 1; }

}  // namespace

LaserLines::LaserLines(const FeatureAccess& features, const GigeOptions& options)
    : features_(features), pattern_(options.pattern), lines_(options.strobe_lines) {
  if (lines_.empty()) {
    require_no_bracket(options.uri);
    return;
  }
  if (pattern_.is_automatic()) pattern_ = IlluminationPattern({Illumination::laser(0)});
  features_.need_one_of("strobe line", {"LineSelector"});
  features_.need_one_of("source of the strobe line", {"LineSource"});
  for (const std::string& line : lines_) add_line(line);
  choose_method(options);
  off();
}

// Who else would set an exposure for each frame?
void LaserLines::require_no_bracket(const std::string& uri) const {
  if (!pattern_.is_bracket()) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("source '{}': laser={} - an exposure for each frame is set by the "
                          "camera's sequencer, together with the laser: add strobe=LINE",
                          uri, pattern_.to_string()));
}

void LaserLines::add_line(const std::string& line) {
  features_.set("LineSelector", line);
  make_output(line);
  if (!features_.has_entry("LineSource", "ExposureActive")) {
    throw Error(ErrorKind::kUnsupported,
                fmt::format("{}: {} cannot be ExposureActive: its LineSource knows only {}",
                            features_.device_name(), line,
                            fmt::join(features_.entries("LineSource"), ", ")));
  }
  dark_sources_.push_back(find_dark_source(line));
  line_bits_.push_back(bit_of_line(line));
}

/// The line is selected. One that is an output needs no writing, which some cameras refuse.
void LaserLines::make_output(const std::string& line) const {
  if (!features_.has("LineMode") || features_.text("LineMode") == "Output") return;
  try {
    features_.set("LineMode", "Output");
  } catch (const Error&) {
    std::vector<std::string> outputs;
    for (const std::string& other : features_.entries("LineSelector")) {
      features_.set("LineSelector", other);
      if (features_.text("LineMode") == "Output") outputs.push_back(other);
    }
    throw Error(
        ErrorKind::kUsage,
        fmt::format("{}: strobe={} - this line cannot be an output; {}", features_.device_name(),
                    line,
                    outputs.empty() ? "none of its lines is one now"
                                    : fmt::format("outputs are {}", fmt::join(outputs, ", "))));
  }
}

std::string LaserLines::find_dark_source(const std::string& line) const {
  if (features_.has_entry("LineSource", "Off")) return "Off";
  for (const std::string& source : features_.entries("LineSource")) {
    const bool is_settable =
        features_.has("UserOutputValue") && features_.has_entry("UserOutputSelector", source);
    if (is_settable) return source;
  }
  throw Error(
      ErrorKind::kUnsupported,
      fmt::format("{}: {} cannot be turned off: its LineSource knows only {}, neither Off "
                  "nor a UserOutput that UserOutputSelector and UserOutputValue set",
                  features_.device_name(), line, fmt::join(features_.entries("LineSource"), ", ")));
}

void LaserLines::choose_method(const GigeOptions& options) {
  if (is_constant(pattern_) && !pattern_.is_bracket()) {
    method_ = Method::kConstant;
    return;
  }
  const bool has_sequencer = features_.first_of({"SequencerConfigurationMode"}) != nullptr &&
                             features_.has("SequencerSetSave");
  const bool has_software_trigger =
      features_.has("TriggerSoftware") && features_.has_entry("TriggerSource", "Software");
  if (has_sequencer && options.switching != LaserSwitching::kHost) {
    method_ = Method::kSequencer;
  } else if (pattern_.is_bracket()) {
    throw Error(ErrorKind::kUnsupported,
                fmt::format("{}: laser={} - an exposure for each frame needs the camera's "
                            "sequencer (SequencerConfigurationMode), which {}",
                            features_.device_name(), pattern_.to_string(),
                            has_sequencer ? "switching=host does not use" : "this one has not"));
  } else if (has_software_trigger && options.switching != LaserSwitching::kSequencer) {
    method_ = Method::kHost;
    if (!options.trigger.empty() && options.trigger != "off" && options.trigger != "software") {
      throw Error(
          ErrorKind::kUsage,
          fmt::format("source '{}': trigger={} - expected software: the host switches the "
                      "laser and triggers, as {}",
                      options.uri, options.trigger,
                      has_sequencer ? "switching=host says" : "this camera has no sequencer"));
    }
  } else {
    throw Error(ErrorKind::kUnsupported,
                fmt::format("{}: cannot switch the laser for laser={}: this camera has {} "
                            "(sequencer: SequencerConfigurationMode; by the host: TriggerSoftware)",
                            features_.device_name(), pattern_.to_string(),
                            options.switching == LaserSwitching::kAuto
                                ? "neither a sequencer nor a software trigger"
                                : "no such way of switching"));
  }
}

void LaserLines::put(std::size_t line, bool fires) {
  if (fires_[line] == fires) return;
  features_.set("LineSelector", lines_[line]);
  features_.set("LineSource", fires ? "ExposureActive" : dark_sources_[line]);
  fires_[line] = fires;
}

void LaserLines::off() {
  if (lines_.empty()) return;
  // Whatever fails, the rest is tried: it may be another line's laser that is on.
  std::exception_ptr first_failure;
  const auto attempt = [&](const auto& write) {
    try {
      write();
    } catch (const Error&) {
      if (!first_failure) first_failure = std::current_exception();
    }
  };
  // A sequencer that runs owns the lines: it goes first.
  if (method_ == Method::kSequencer) attempt([&] { features_.set("SequencerMode", "Off"); });
  fires_.assign(lines_.size(), true);  // Whatever they are: each is written.
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    if (dark_sources_[i] != "Off") {
      attempt([&] {
        features_.set("UserOutputSelector", dark_sources_[i]);
        features_.set("UserOutputValue", "no");
      });
    }
    attempt([&] { put(i, false); });
  }
  if (first_failure) std::rethrow_exception(first_failure);
}

bool LaserLines::try_off() noexcept {
  try {
    off();
    return true;
  } catch (const std::exception& failure) {
    features_.events().send(
        {"laser_not_off", fmt::format("cannot command the laser off: {}", failure.what())});
    return false;
  }
}

void LaserLines::arm() {
  if (method_ == Method::kConstant) {
    put(static_cast<std::size_t>(pattern_.entries().front().laser_index()), true);
  } else if (method_ == Method::kSequencer) {
    program_sequencer();
  }
}

void LaserLines::program_sequencer() {
  features_.set("SequencerMode", "Off");
  features_.set("SequencerConfigurationMode", "On");
  if (pattern_.is_bracket() && features_.has_entry("SequencerFeatureSelector", "ExposureTime")) {
    features_.set("SequencerFeatureSelector", "ExposureTime");
    features_.try_set("SequencerFeatureEnable", "yes");
  }
  const auto& entries = pattern_.entries();
  for (std::size_t n = 0; n < entries.size(); ++n) {
    features_.set_integer("SequencerSetSelector", static_cast<std::int64_t>(n));
    for (std::size_t line = 0; line < lines_.size(); ++line) {
      put(line, entries[n].is_lit() && static_cast<std::size_t>(entries[n].laser_index()) == line);
    }
    if (pattern_.is_bracket()) {
      set_exposure(features_, pattern_.exposure_us_at(n));
    }
    if (features_.has("SequencerPathSelector")) features_.set_integer("SequencerPathSelector", 0);
    features_.set_integer("SequencerSetNext", static_cast<std::int64_t>((n + 1) % entries.size()));
    features_.try_set("SequencerTriggerSource", "FrameStart");
    features_.execute("SequencerSetSave");
  }
  if (features_.has("SequencerSetStart")) features_.set_integer("SequencerSetStart", 0);
  features_.set("SequencerConfigurationMode", "Off");
  features_.set("SequencerMode", "On");
}

void LaserLines::command(Illumination light) {
  for (std::size_t line = 0; line < lines_.size(); ++line) {
    if (!light.is_lit() || static_cast<std::size_t>(light.laser_index()) != line) put(line, false);
  }
  if (light.is_lit()) put(static_cast<std::size_t>(light.laser_index()), true);
}

Illumination LaserLines::at(std::uint64_t n) const noexcept {
  const bool is_ours = method_ == Method::kConstant || method_ == Method::kSequencer;
  return is_ours ? pattern_.at(n) : Illumination::unknown();
}

bool LaserLines::enable_line_chunk() {
  const bool are_known = std::all_of(line_bits_.begin(), line_bits_.end(),
                                     [](const auto& bit) { return bit.has_value(); });
  if (lines_.empty() || !are_known) return false;
  if (!features_.has("ChunkModeActive") || !features_.has("ChunkSelector")) return false;
  features_.set("ChunkModeActive", "yes");
  if (features_.has_entry("ChunkSelector", "LineStatusAll") && features_.has("ChunkEnable")) {
    features_.set("ChunkSelector", "LineStatusAll");
    features_.set("ChunkEnable", "yes");
    return true;
  }
  features_.set("ChunkModeActive", "no");
  return false;
}

Illumination LaserLines::from_line_status(std::int64_t status_all) const noexcept {
  for (std::size_t i = 0; i < line_bits_.size(); ++i) {
    if (line_bits_[i] && ((status_all >> *line_bits_[i]) & 1) != 0) {
      return Illumination::laser(static_cast<int>(i));
    }
  }
  return Illumination::dark();
}

}  // namespace striper::detail
