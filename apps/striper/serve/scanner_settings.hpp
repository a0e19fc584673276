// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <striper/stream/head.hpp>
#include <striper/stream/sink_services.hpp>

#include "options/scanner_arguments.hpp"

namespace striper::program {

/// The options of a head's scanner, which may change while it runs. Thread-safe.
class ScannerSettings {
 public:
  /// @param explains whether its scanners can say why a scan line gave what it gave.
  ScannerSettings(ScannerArguments arguments, std::string head, bool explains);

  /// The scanner by the options as they are now. @throws as `scanner_setup` and `make_scanner`.
  HeadScanner make(const SourceInfo& source, const EventPort& events);

  /// Every option of `scanner_options()`, as the scanner has it.
  std::vector<Parameter> list() const;

  /// The same with what each may be; `at_start` is left to who knows it.
  std::vector<ParameterForm> forms() const;

  /// The arguments as they are now.
  ScannerArguments arguments() const;

  /// Whether there is such an option.
  static bool has(std::string_view name);

  /// Sets one for scanners that are made from now on; without a value it is the model's, or the
  /// default, again. Nothing changes where no scanner can be made with it.
  /// @throws Error as `set_scanner_option`, `scanner_setup` and `make_scanner`.
  void set(const Parameter& wanted);

 private:
  ScannerSetup setup(const ScannerArguments& arguments, const SourceInfo& source,
                     const EventPort& events) const;

  const std::string head_;
  const bool explains_;
  mutable std::mutex mutex_;
  ScannerArguments arguments_;
  std::optional<SourceInfo> source_;  // Of the scanner that was made last.
  ScannerOptions options_;            // Its options.
};

}  // namespace striper::program
