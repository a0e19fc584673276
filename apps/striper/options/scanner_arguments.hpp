// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <striper/core/frame_source.hpp>
#include <striper/pipeline/scanner.hpp>

#include "program/command.hpp"

namespace striper::program {

/// The options of every command that turns frames into scans. An option beats the model file, which
/// beats the default.
struct ScannerArguments {
  std::optional<std::string> model;
  std::map<std::string, std::string, std::less<>> given;  ///< By the names of `scanner_options()`.

  bool has(std::string_view name) const { return given.find(name) != given.end(); }
  /// Whether an option was given with this value.
  bool is(std::string_view name, std::string_view value) const {
    const auto found = given.find(name);
    return found != given.end() && found->second == value;
  }
};

/// `--model` and an option for each of `scanner_options()`.
void add_scanner_arguments(Command& command, ScannerArguments& arguments);

/// What the options, and the model that they name, come to.
struct ScannerSetup {
  std::optional<StriperModel> model;
  ScannerOptions options;
};

/// How a source is to be scanned, with or without a model; the pattern is the source's.
/// @throws Error as `load_model` does; Error{kBadFile} where the model is of another camera than
///         the source's or has no laser.
/// @param events hears what is wrong with the model, and later what the scanner has to say.
ScannerSetup scanner_setup(const ScannerArguments& arguments, const SourceInfo& source,
                           const EventPort& events = {});

/// The model of a setup, to share; null without one.
std::shared_ptr<const StriperModel> shared_model(const ScannerSetup& setup);

/// The scanner for that.
/// @throws Error as Scanner does.
Scanner make_scanner(const ScannerSetup& setup);

/// "along columns (the default), channel red (as the model says)": where the stripe is looked for,
/// and who said so.
std::string describe_search(const ScannerArguments& arguments, const ScannerSetup& setup);

}  // namespace striper::program
