// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <striper/stream/head.hpp>
#include <striper/stream/scan_bus.hpp>

namespace striper {

/// A head, as who serves it knows it.
struct ServedHead {
  std::string name;
  std::string source;  ///< As it was named.
  std::string model;   ///< Its file; empty without one.
  HeadHealth health;
  std::string plays;  ///< The recording that it plays back; empty of one that measures.
};

/// A value as people write it: none, a switch, a number, a word, several numbers.
using ParameterValue = std::variant<std::monostate, bool, double, std::string, std::vector<double>>;

/// What can be read of a head, and mostly set while it runs: a control of its source or an option
/// of its scanner.
struct Parameter {
  std::string name;  ///< Within the head: `exposure_us`, `threshold`.
  ParameterValue value;
};

/// What a parameter is and may be, for a form: a row of the source's controls or of
/// `scanner_options()`.
struct ParameterForm {
  std::string name;
  bool is_control = false;         ///< Of the source; else of the scanner.
  std::string type;                ///< `number`, `switch`, `word`, `region` or `pose`.
  std::string unit;                ///< Of a number; may be empty.
  std::vector<std::string> words;  ///< What a word may be.
  std::vector<double> minimum;     ///< Of each number; empty or infinite: there is none.
  std::vector<double> maximum;
  bool is_writable = true;
  std::string if_not_given;  ///< What no value stands for: "from the noise".
  std::string help;          ///< A sentence without its full stop; may be empty.
  ParameterValue value;
  ParameterValue at_start;  ///< What it was before anybody changed it.
};

/// What a head can be told.
enum class HeadCommand {
  kStart,      ///< Open the source again.
  kStop,       ///< Close it.
  kLasersOff,  ///< Until kLasersOn, whatever is opened again.
  kLasersOn,
  kRecord,  ///< Frames and scans, to a file of their own.
};

struct RecordingFile {
  std::string name;
  std::uint64_t bytes = 0;
  double time_s = 0.0;  ///< When it was last written, UTC.
};

/// What a sink may ask of the program that it works for, for people who ask the sink. Thread-safe;
/// to be asked until the sink's `finish` returns. Empty where the program does not tell.
struct SinkServices {
  std::function<std::vector<ServedHead>()> heads;
  std::function<std::vector<SinkReport>()> sinks;
  std::function<std::vector<RecordingFile>()> recordings;
  /// Where a recording of that name lies. @throws Error{kNotFound}.
  std::function<std::string(std::string_view name)> recording_path;
  /// What is wrong with a head, and what to do about it, of late; never waits for it.
  std::function<std::vector<Event>(std::string_view head)> findings;

  // What follows takes as long as a camera takes to answer. @throws Error{kNotFound} for a head
  // that is not there, Error{kDevice}; Error{kUsage}, {kBadValue} for what cannot be,
  // {kUnsupported} for what is not allowed.
  std::function<std::vector<Parameter>(std::string_view head)> parameters;
  std::function<void(std::string_view head, const Parameter& wanted)> set_parameter;
  std::function<std::vector<ParameterForm>(std::string_view head)> parameter_forms;
  /// @param seconds of kRecord. @return what came of it, as a sentence.
  std::function<std::string(std::string_view head, HeadCommand command, double seconds)> command;
  /// Why a scan line of the next frame gives what it gives, as JSON: that of `striper why --json`.
  std::function<std::string(std::string_view head, int line)> why;
  /// What is in a recording, as JSON: that of `striper info --json`. Reads all of it.
  std::function<std::string(std::string_view name)> recording_info;
  /// Plays a recording back as a head of its own, beside those that measure, in place of one that
  /// is played; an empty name ends it. @return what came of it, as a sentence.
  std::function<std::string(std::string_view name)> play;

  /// The secret that whoever changes something has to show; empty: nobody may. Made when first
  /// asked for.
  std::function<std::string()> token;
};

}  // namespace striper
