// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <striper/stream/head.hpp>
#include <striper/stream/sink_services.hpp>

#include "serve/head_recorder.hpp"
#include "serve/scanner_settings.hpp"

namespace striper::program {

/// Takes what people want of a head to where it is done. What may light a laser is refused unless
/// the program was told to allow it, whoever asks. Thread-safe.
class HeadDesk {
 public:
  /// All outlive the desk.
  struct Behind {
    Head& head;
    ScannerSettings& settings;
    HeadRecorder* recorder;  ///< Null where nothing can be recorded.
    EventPort events;
  };

  HeadDesk(std::string name, const Behind& behind, bool may_switch_lasers_on);

  /// @throws Error{kNotFound} for another head's name, as all of these.
  std::vector<Parameter> parameters(std::string_view head) const;
  /// What they are and may be, and what they were before anybody changed them.
  std::vector<ParameterForm> forms(std::string_view head) const;
  /// @throws as `Head::set_control` and `ScannerSettings::set`; Error{kNotFound} for a name that
  ///         nothing has, Error{kUnsupported} for what is not allowed.
  void set(std::string_view head, const Parameter& wanted);
  /// @throws as `Head::switch_lasers` and `HeadRecorder::begin`; Error{kUnsupported} for what is
  ///         not allowed.
  std::string command(std::string_view head, HeadCommand command, double seconds);
  /// @throws as `Head::explain`.
  std::string why(std::string_view head, int line) const;

 private:
  bool is_open() const;
  std::vector<Control> controls() const;
  void remember(const std::string& name, const ParameterValue& value) const;
  std::string record(double seconds);
  void check_head(std::string_view head) const;
  void check_lasers_on(std::string_view what) const;
  bool fires_lasers() const;
  void start();
  void stop();
  void note(const std::string& what) const;

  const std::string name_;
  const Behind behind_;
  const bool may_switch_lasers_on_;
  std::atomic<bool> is_stopped_ = false;
  std::atomic<bool> fired_lasers_ = true;  // The source, when it was stopped.
  mutable std::mutex mutex_;
  mutable std::map<std::string, ParameterValue, std::less<>> at_start_;  // As they were first seen.
};

}  // namespace striper::program
