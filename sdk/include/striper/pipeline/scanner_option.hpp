// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <striper/pipeline/scanner.hpp>

namespace striper {

/// One of the ScannerOptions that people set by name: on the command line (`--min-confidence`), in
/// files and in programs (`min_confidence`). Everything that takes options is made from the table
/// `scanner_options()`.
struct ScannerOption {
  std::string_view name;  ///< Lower case, words joined by underscores.
  std::string_view unit;  ///< Of a number: `px`, `m`, `DN`, `probability`; empty for words.
  /// What a word may be; empty: a number, or what `form` says.
  std::vector<std::string_view> words;
  std::string_view form{};  ///< Of text that is neither word nor number: `X,Y,W,H`, `FILE`.
  double low = -std::numeric_limits<double>::infinity();  ///< A number lies within these,
  double high = std::numeric_limits<double>::infinity();
  bool is_low_allowed = true;          ///< the lower one included or not.
  std::string_view what_if_not_given;  ///< "the model's, else columns"; empty: `get` tells.
  std::string_view help;               ///< A sentence without its full stop.

  /// Sets what `why_not` accepts. What was asked for holds whatever the model says.
  void (*put)(ScannerOptions& options, std::string_view value);
  /// As text that `put` takes; empty where nothing is set.
  std::string (*get)(const ScannerOptions& options);

  /// Of text with a form: why it cannot be; empty where it can.
  std::string (*why_no_text)(std::string_view value) = nullptr;

  bool is_number() const noexcept { return words.empty() && form.empty(); }

  /// Why a value cannot be: "'u' is none of columns, rows"; empty where it can.
  std::string why_not(std::string_view value) const;
};

/// Every option, in the order of help texts.
std::span<const ScannerOption> scanner_options();

/// The option of a name; null where there is none. Hyphens count as underscores.
const ScannerOption* find_scanner_option(std::string_view name);

/// Sets one by name. @throws Error{kUsage} naming the option and what it may be.
void set_scanner_option(ScannerOptions& options, std::string_view name, std::string_view value);

}  // namespace striper
