// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include <striper/core/frame_source.hpp>
#include <striper/pipeline/scanner.hpp>

namespace striper::program {

/// The options of every command that turns frames into scans. An option beats the model file, which
/// beats the default.
struct ScannerArguments {
  std::optional<std::string> model;
  std::optional<std::string> method;
  std::optional<std::string> peak;
  std::optional<std::string> axis;
  std::optional<std::string> channel;
  std::optional<std::string> ambient;
  std::optional<double> threshold_dn;
  std::optional<double> width_px;
  std::optional<double> min_confidence;
  std::optional<double> min_range_m;
  std::optional<double> max_range_m;
};

void add_scanner_arguments(CLI::App& command, ScannerArguments& arguments);

/// What the options, and the model that they name, come to.
struct ScannerSetup {
  std::optional<StriperModel> model;
  ScannerOptions options;
};

/// How a source is to be scanned, with or without a model; the cadence is the source's.
/// @throws Error as `load_model` does; Error{kBadFile} where the model is of another camera than
///         the source's or has no laser.
ScannerSetup scanner_setup(const ScannerArguments& arguments, const SourceInfo& source);

/// The scanner for that.
/// @throws Error as Scanner does.
Scanner make_scanner(const ScannerSetup& setup);

/// "along columns (the default), channel red (as the model says)": where the stripe is looked for,
/// and who said so.
std::string describe_search(const ScannerArguments& arguments, const ScannerSetup& setup);

}  // namespace striper::program
