// SPDX-License-Identifier: Apache-2.0
#include "scanner_arguments.hpp"

#include <array>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>

#include "program.hpp"

namespace striper::program {
namespace {

constexpr std::array<std::pair<std::string_view, ExtractMethod>, 3> kMethods{{
    {"paper", ExtractMethod::kPaper},
    {"fast", ExtractMethod::kFast},
    {"refined", ExtractMethod::kRefined},
}};

constexpr std::array<std::pair<std::string_view, PeakRule>, 5> kPeakRules{{
    {"brightest", PeakRule::kBrightest},
    {"nearest", PeakRule::kNearest},
    {"farthest", PeakRule::kFarthest},
    {"continuous", PeakRule::kContinuous},
    {"all", PeakRule::kAll},
}};

constexpr std::array<std::pair<std::string_view, AmbientMethod>, 5> kAmbientMethods{{
    {"auto", AmbientMethod::kAuto},
    {"none", AmbientMethod::kNone},
    {"alternate", AmbientMethod::kAlternate},
    {"fields", AmbientMethod::kFields},
    {"temporal", AmbientMethod::kTemporal},
}};

// The command line has checked the word.
template <typename Value, std::size_t N>
void set_from_word(const std::optional<std::string>& word,
                   const std::array<std::pair<std::string_view, Value>, N>& words, Value& value) {
  for (const auto& [known, meaning] : words) {
    if (word == known) value = meaning;
  }
}

StriperModel load_model_for(const SourceInfo& source, const std::string& path) {
  StriperModel model = load_model(path);
  if (model.lasers.empty()) {
    throw Error(ErrorKind::kBadFile,
                fmt::format("'{}': lasers: is empty: a camera alone gives no ranges", path));
  }
  const cv::Size camera(model.camera.width(), model.camera.height());
  if (!source.sensor_size.empty() && source.sensor_size != camera) {
    throw Error(ErrorKind::kBadFile,
                fmt::format("'{}' is of a camera of {}x{} pixels, but source '{}' has {}x{}", path,
                            camera.width, camera.height, source.uri, source.sensor_size.width,
                            source.sensor_size.height));
  }
  return model;
}

void apply(const ScannerArguments& arguments, ScannerOptions& options) {
  set_from_word(arguments.method, kMethods, options.stripe.method);
  set_from_word(arguments.peak, kPeakRules, options.stripe.peak);
  set_from_word(arguments.ambient, kAmbientMethods, options.ambient.method);
  if (arguments.axis) options.stripe.axis = *stripe_axis_from_string(*arguments.axis);
  if (arguments.channel) {
    options.ambient.channel = *channel_from_string(*arguments.channel);
    options.ambient.difference_channel.reset();  // What was asked for holds everywhere.
  }
  if (arguments.threshold_dn) options.stripe.threshold_dn = arguments.threshold_dn;
  if (arguments.width_px) options.stripe.stripe_sigma_px = arguments.width_px;
  if (arguments.min_confidence) options.stripe.min_confidence = *arguments.min_confidence;
  if (arguments.min_range_m) options.scan.min_range_m = *arguments.min_range_m;
  if (arguments.max_range_m) options.scan.max_range_m = *arguments.max_range_m;
}

void refuse_contradictions(const ScannerArguments& arguments) {
  if (!arguments.model && (arguments.min_range_m || arguments.max_range_m)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("{} needs --model: without it there are no ranges",
                            arguments.min_range_m ? "--min-range" : "--max-range"));
  }
  if (arguments.method != "paper") return;
  if (arguments.width_px || arguments.min_confidence) {
    throw Error(ErrorKind::kUsage,
                fmt::format("{} is for --method fast or refined: paper knows neither the stripe's "
                            "width nor a probability",
                            arguments.width_px ? "--width" : "--min-confidence"));
  }
  if (!arguments.peak || arguments.peak == "brightest") return;
  throw Error(ErrorKind::kUsage,
              fmt::format("--peak {} is for --method fast or refined: paper knows the brightest "
                          "pixel alone",
                          *arguments.peak));
}

void require_fields(AmbientMethod method, const SourceInfo& source) {
  if (method != AmbientMethod::kFields || source.field != Field::kProgressive) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("--ambient fields needs pictures of two fields, and source '{}' gives "
                          "whole ones; if they are woven of two, say so in its address with "
                          "fields=split-top or fields=split-bottom (the field exposed first; NTSC "
                          "has the bottom one first, PAL the top one)",
                          source.uri));
}

// Who said it.
const char* origin(bool is_asked, const ScannerSetup& setup) {
  if (is_asked) return "as you asked";
  return setup.model ? "as the model says" : "the default";
}

}  // namespace

void add_scanner_arguments(CLI::App& command, ScannerArguments& arguments) {
  command
      .add_option(
          "-m,--model", arguments.model,
          "The calibrated striper (striper.yaml); without it there are no ranges, only where "
          "the stripe is in the picture")
      ->type_name("FILE");
  command
      .add_option("--method", arguments.method,
                  "How the stripe is found: paper (the brightest pixel and its two neighbours), "
                  "fast or refined (the default)")
      ->type_name("NAME")
      ->check(one_of({"paper", "fast", "refined"}));
  command
      .add_option("--peak", arguments.peak,
                  "Which of several peaks of a line is the stripe: brightest (the default), "
                  "nearest, farthest, continuous (the one that continues its neighbours, for weak "
                  "stripes) or all")
      ->type_name("NAME")
      ->check(one_of({"brightest", "nearest", "farthest", "continuous", "all"}));
  command
      .add_option(
          "--axis", arguments.axis,
          "One return per image line: columns (the stripe runs from left to right) or rows; "
          "default: the model's, else columns")
      ->type_name("NAME")
      ->check(one_of({"columns", "rows"}));
  command
      .add_option("--channel", arguments.channel,
                  "What of a colour picture is searched: auto, grey, red, green, blue, green-red "
                  "or red-green; default: the model's, else auto")
      ->type_name("NAME")
      ->check(one_of({"auto", "grey", "red", "green", "blue", "green-red", "red-green"}));
  command
      .add_option("--ambient", arguments.ambient,
                  "How daylight is taken off: auto (the default: what the lasers' cadence allows), "
                  "none, alternate (dark pictures), fields (dark fields; the source must have "
                  "fields, see fields= below) or temporal (a standing sensor before a stripe that "
                  "wanders)")
      ->type_name("NAME")
      ->check(one_of({"auto", "none", "alternate", "fields", "temporal"}));
  command
      .add_option(
          "--threshold", arguments.threshold_dn,
          "A stripe rises this far above the background, in digital numbers of the picture; "
          "default: from the noise")
      ->type_name("DN");
  command
      .add_option("--width", arguments.width_px,
                  "The stripe's Gaussian sigma (its width at half its height over 2.35), pixels of "
                  "the picture; default: the model's, else measured")
      ->type_name("PX")
      ->check(above_zero());
  command
      .add_option("--min-confidence", arguments.min_confidence,
                  fmt::format("Returns that are the stripe with a smaller probability than this "
                              "are outlier, 0 to 1; default {}",
                              ExtractOptions{}.min_confidence))
      ->type_name("P")
      ->check(probability());
  command
      .add_option("--min-range", arguments.min_range_m, "Nearer returns are out_of_range, metres")
      ->type_name("M");
  command
      .add_option("--max-range", arguments.max_range_m, "Farther returns are out_of_range, metres")
      ->type_name("M");
}

ScannerSetup scanner_setup(const ScannerArguments& arguments, const SourceInfo& source) {
  refuse_contradictions(arguments);
  ScannerSetup setup;
  if (arguments.model) {
    setup.model = load_model_for(source, *arguments.model);
    if (arguments.axis) setup.model->axis = *stripe_axis_from_string(*arguments.axis);
    setup.options = ScannerOptions::for_model(*setup.model);
  }
  apply(arguments, setup.options);
  setup.options.ambient.cadence = source.cadence;
  require_fields(setup.options.ambient.method, source);
  return setup;
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
                     origin(arguments.axis.has_value(), setup), channels,
                     origin(arguments.channel.has_value(), setup));
}

}  // namespace striper::program
