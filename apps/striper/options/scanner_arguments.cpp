// SPDX-License-Identifier: Apache-2.0
#include "options/scanner_arguments.hpp"

#include <algorithm>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/frame.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/model/source_fit.hpp>
#include <striper/pipeline/scanner_option.hpp>

#include "program/program.hpp"

namespace striper::program {
namespace {

// `--min-range`
std::string flag_of(std::string_view name) {
  std::string flag = "--" + std::string(name);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

std::string type_name_of(const ScannerOption& option) {
  if (!option.form.empty()) return std::string(option.form);
  if (!option.is_number()) return "NAME";
  if (option.unit == "probability") return "P";
  return option.unit == "px" ? "PX" : option.unit == "m" ? "M" : "DN";
}

StriperModel load_model_for(const SourceInfo& source, const std::string& path,
                            const EventPort& events) {
  StriperModel model = load_model(path, events);
  if (model.lasers.empty()) {
    throw Error(ErrorKind::kBadFile,
                fmt::format("'{}': lasers: is empty: a camera alone gives no ranges", path));
  }
  const std::string why_not = why_not_of_source(model, source);
  if (!why_not.empty()) throw Error(ErrorKind::kBadFile, fmt::format("'{}' {}", path, why_not));
  return model;
}

void refuse_contradictions(const ScannerArguments& arguments) {
  for (const char* const limit : {"min_range", "max_range"}) {
    if (arguments.model || !arguments.has(limit)) continue;
    throw Error(ErrorKind::kUsage,
                fmt::format("{} needs --model: without it there are no ranges", flag_of(limit)));
  }
  if (!arguments.is("method", "paper")) return;
  for (const char* const of_others : {"width", "min_confidence"}) {
    if (!arguments.has(of_others)) continue;
    throw Error(ErrorKind::kUsage,
                fmt::format("{} is for --method fast or refined: paper knows neither the stripe's "
                            "width nor a probability",
                            flag_of(of_others)));
  }
  if (!arguments.has("peak") || arguments.is("peak", "brightest")) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("--peak {} is for --method fast or refined: paper knows the brightest "
                          "pixel alone",
                          arguments.given.find("peak")->second));
}

void require_fields(AmbientMethod method, const SourceInfo& source) {
  if (method != AmbientMethod::kFields || source.field != Field::kProgressive) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("--ambient fields needs frames of two fields, and source '{}' gives "
                          "whole ones; if they are interlaced, say so in its address with "
                          "fields=split-top or fields=split-bottom (the field exposed first; NTSC "
                          "has the bottom one first, PAL the top one)",
                          source.uri));
}

// Above full scale nothing would ever be found.
void require_threshold(const std::optional<double>& threshold_dn, const SourceInfo& source) {
  const int full_dn = full_scale_dn(source.bit_depth);
  if (!threshold_dn || *threshold_dn < full_dn) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("--threshold {}: the frames of '{}' have {} bits and end at {} DN",
                          *threshold_dn, source.uri, source.bit_depth, full_dn));
}

void warn_of_grey(const ScannerArguments& arguments, Channel channel, const SourceInfo& source,
                  const EventPort& events) {
  const bool is_colour = channel != Channel::kGrey && channel != Channel::kAuto;
  if (!arguments.has("channel") || !is_colour || source.channels != 1) return;
  events.send({"channel_of_grey",
               fmt::format("--channel {}: the frames of '{}' are grey, and so is what is searched",
                           to_string(channel), source.uri)});
}

// Who said it.
const char* origin(bool is_asked, const ScannerSetup& setup) {
  if (is_asked) return "as you asked";
  return setup.model ? "as the model says" : "the default";
}

void add_option(Command& command, const ScannerOption& option, ScannerArguments& arguments) {
  const std::string otherwise = option.what_if_not_given.empty()
                                    ? option.get(ScannerOptions{})
                                    : std::string(option.what_if_not_given);
  const auto keep = [&arguments, name = std::string(option.name)](const std::string& value) {
    arguments.given[name] = value;
  };
  command
      .add_word(flag_of(option.name), keep, fmt::format("{}; default: {}", option.help, otherwise))
      ->type_name(type_name_of(option))
      ->check([&option](const std::string& value) { return option.why_not(value); });
}

}  // namespace

void add_scanner_arguments(Command& command, ScannerArguments& arguments) {
  command
      .add_option(
          "-m,--model", arguments.model,
          "The calibrated striper (striper.yaml); without it there are no ranges, only where "
          "the stripe is in the image")
      ->type_name("FILE");
  for (const ScannerOption& option : scanner_options()) add_option(command, option, arguments);
}

ScannerSetup scanner_setup(const ScannerArguments& arguments, const SourceInfo& source,
                           const EventPort& events) {
  refuse_contradictions(arguments);
  ScannerSetup setup;
  if (arguments.model) {
    setup.model = load_model_for(source, *arguments.model, events);
  }
  for (const auto& [name, value] : arguments.given) set_scanner_option(setup.options, name, value);
  if (setup.model) {
    setup.options = ScannerOptions::for_model(*setup.model, std::move(setup.options));
    setup.model->axis = setup.options.stripe.axis;
  }
  setup.options.events = events;
  setup.options.ambient.pattern = source.pattern;
  require_fields(setup.options.ambient.method, source);
  require_threshold(setup.options.stripe.threshold_dn, source);
  warn_of_grey(arguments, setup.options.ambient.channel, source, events);
  return setup;
}

std::shared_ptr<const StriperModel> shared_model(const ScannerSetup& setup) {
  return setup.model ? std::make_shared<const StriperModel>(*setup.model) : nullptr;
}

Scanner make_scanner(const ScannerSetup& setup) {
  return setup.model ? Scanner(*setup.model, setup.options) : Scanner(setup.options);
}

std::string describe_search(const ScannerArguments& arguments, const ScannerSetup& setup) {
  const AmbientOptions& ambient = setup.options.ambient;
  std::string channels(to_string(ambient.channel));
  if (ambient.difference_channel && ambient.difference_channel != ambient.channel) {
    channels +=
        fmt::format(", {} where dark is subtracted", to_string(*ambient.difference_channel));
  }
  return fmt::format("along {} ({}), channel {} ({})", to_string(setup.options.stripe.axis),
                     origin(arguments.has("axis"), setup), channels,
                     origin(arguments.has("channel"), setup));
}

}  // namespace striper::program
