// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>
#include <striper/pipeline/scanner_option.hpp>

namespace striper {
namespace {

template <typename Value, std::size_t N>
using Words = std::array<std::pair<std::string_view, Value>, N>;

constexpr Words<ExtractMethod, 3> kMethods{{
    {"paper", ExtractMethod::kPaper},
    {"fast", ExtractMethod::kFast},
    {"refined", ExtractMethod::kRefined},
}};

constexpr Words<PeakRule, 5> kPeakRules{{
    {"brightest", PeakRule::kBrightest},
    {"nearest", PeakRule::kNearest},
    {"farthest", PeakRule::kFarthest},
    {"continuous", PeakRule::kContinuous},
    {"all", PeakRule::kAll},
}};

constexpr Words<AmbientMethod, 5> kAmbientMethods{{
    {"auto", AmbientMethod::kAuto},
    {"none", AmbientMethod::kNone},
    {"alternate", AmbientMethod::kAlternate},
    {"fields", AmbientMethod::kFields},
    {"temporal", AmbientMethod::kTemporal},
}};

constexpr Words<StripeAxis, 2> kAxes{{
    {to_string(StripeAxis::kColumns), StripeAxis::kColumns},
    {to_string(StripeAxis::kRows), StripeAxis::kRows},
}};

const Words<Channel, 7> kChannels{{
    {to_string(Channel::kAuto), Channel::kAuto},
    {to_string(Channel::kGrey), Channel::kGrey},
    {to_string(Channel::kRed), Channel::kRed},
    {to_string(Channel::kGreen), Channel::kGreen},
    {to_string(Channel::kBlue), Channel::kBlue},
    {to_string(Channel::kGreenMinusRed), Channel::kGreenMinusRed},
    {to_string(Channel::kRedMinusGreen), Channel::kRedMinusGreen},
}};

constexpr Words<bool, 2> kExposures{{{"fixed", false}, {"auto", true}}};

template <typename Value, std::size_t N>
std::vector<std::string_view> words_of(const Words<Value, N>& known) {
  std::vector<std::string_view> words;
  for (const auto& [word, value] : known) words.push_back(word);
  return words;
}

// What a word means; `why_not` refuses others first, with words for people.
template <typename Value, std::size_t N>
Value word_in(const Words<Value, N>& known, std::string_view word) {
  for (const auto& [name, meaning] : known) {
    if (name == word) return meaning;
  }
  throw Error(ErrorKind::kUsage, fmt::format("'{}' is no word of this option", word));
}

template <typename Value, std::size_t N>
std::string word_for(const Words<Value, N>& known, Value value) {
  for (const auto& [word, meaning] : known) {
    if (meaning == value) return std::string(word);
  }
  return {};
}

std::optional<double> number_in(std::string_view text) {
  double number = 0.0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error != std::errc() || end != last || std::isnan(number)) return std::nullopt;
  return number;
}

double number_of(std::string_view text) { return number_in(text).value_or(0.0); }

std::string text_of(const std::optional<double>& number) {
  return number ? fmt::format("{}", *number) : std::string();
}

constexpr std::string_view kRegionForm = "X,Y,W,H";

// Whole numbers of the full sensor's pixels; the last two are sizes.
std::optional<cv::Rect> region_in(std::string_view text) {
  std::array<int, 4> numbers{};
  const char* at = text.data();
  const char* const last = at + text.size();
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0 && (at == last || *at++ != ',')) return std::nullopt;
    const auto [end, error] = std::from_chars(at, last, numbers[i]);
    if (error != std::errc() || numbers[i] < (i < 2 ? 0 : 1)) return std::nullopt;
    at = end;
  }
  if (at != last) return std::nullopt;
  return cv::Rect(numbers[0], numbers[1], numbers[2], numbers[3]);
}

std::string text_of(const std::optional<cv::Rect>& region) {
  if (!region) return {};
  return fmt::format("{},{},{},{}", region->x, region->y, region->width, region->height);
}

std::string why_no_region(std::string_view text) {
  if (region_in(text)) return {};
  return fmt::format("'{}' is no {}, whole pixels of the sensor", text, kRegionForm);
}

std::string why_no_mask(std::string_view file) {
  try {
    load_mask(file);
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

using Options = ScannerOptions;
using Text = std::string_view;

// Those that are chosen by a word.
std::vector<ScannerOption> choices() {
  return {
      {.name = "method",
       .unit = {},
       .words = words_of(kMethods),
       .what_if_not_given = "refined",
       .help = "How the stripe is found: paper (the brightest pixel and its two neighbours), fast "
               "or refined",
       .put = [](Options& o, Text v) { o.stripe.method = word_in(kMethods, v); },
       .get = [](const Options& o) { return word_for(kMethods, o.stripe.method); }},
      {.name = "peak",
       .unit = {},
       .words = words_of(kPeakRules),
       .what_if_not_given = "brightest",
       .help =
           "Which of several peaks of a scan line is the stripe: continuous (the brightest, and "
           "where a scan line alone cannot tell the one that continues its neighbours), "
           "brightest, nearest, farthest or all",
       .put = [](Options& o, Text v) { o.stripe.peak = word_in(kPeakRules, v); },
       .get = [](const Options& o) { return word_for(kPeakRules, o.stripe.peak); }},
      {.name = "axis",
       .unit = {},
       .words = words_of(kAxes),
       .what_if_not_given = "the model's, else columns",
       .help = "One return per scan line: columns (the stripe runs from left to right) or rows",
       .put = [](Options& o, Text v) { o.stripe.axis = word_in(kAxes, v); },
       .get = [](const Options& o) { return word_for(kAxes, StripeAxis(o.stripe.axis)); }},
      {.name = "channel",
       .unit = {},
       .words = words_of(kChannels),
       .what_if_not_given = "the model's, else auto",
       .help = "What of a colour image is searched: auto, grey, red, green, blue, green-red or "
               "red-green",
       .put =
           [](Options& o, Text v) {
             o.ambient.channel = word_in(kChannels, v);
             o.ambient.difference_channel.reset();  // What was asked for holds everywhere.
           },
       .get = [](const Options& o) { return word_for(kChannels, Channel(o.ambient.channel)); }},
      {.name = "ambient",
       .unit = {},
       .words = words_of(kAmbientMethods),
       .what_if_not_given = "auto: what the illumination pattern allows",
       .help = "How daylight is subtracted: auto, none, alternate (dark exposures), fields (dark "
               "fields; the source must have fields, see fields= below) or temporal (a standing "
               "sensor before a stripe that wanders)",
       .put = [](Options& o, Text v) { o.ambient.method = word_in(kAmbientMethods, v); },
       .get = [](const Options& o) { return word_for(kAmbientMethods, o.ambient.method); }},
      {.name = "exposure",
       .unit = {},
       .words = words_of(kExposures),
       .what_if_not_given = "fixed",
       .help = "The source's exposure: fixed, or auto (set while it streams, by how bright the "
               "stripe is; for sources whose exposure_us can be set)",
       .put = [](Options& o, Text v) { o.adapts_exposure = word_in(kExposures, v); },
       .get = [](const Options& o) { return word_for(kExposures, o.adapts_exposure); }},
  };
}

// What is written in a way of its own.
std::vector<ScannerOption> texts() {
  return {
      {.name = "region",
       .unit = {},
       .words = {},
       .form = kRegionForm,
       .what_if_not_given = "all of the image",
       .help = "Scan this part of the image only: left, top, width and height in pixels of the "
               "full sensor",
       .put = [](Options& o, Text v) { o.region = region_in(v); },
       .get = [](const Options& o) { return text_of(o.region); },
       .why_no_text = why_no_region},
      {.name = "mask",
       .unit = {},
       .words = {},
       .form = "FILE",
       .what_if_not_given = "nothing is ignored",
       .help = "Ignore what lies here: an image file of the sensor's size, black where it is "
               "ignored, or a .yaml file of polygons in pixels or in metres of the scan plane",
       .put = [](Options& o, Text v) { o.mask = std::make_shared<const ScanMask>(load_mask(v)); },
       .get = [](const Options& o) { return o.mask ? o.mask->name : std::string(); },
       .why_no_text = why_no_mask},
  };
}

std::vector<ScannerOption> numbers() {
  return {
      {.name = "threshold",
       .unit = "DN",
       .words = {},
       .what_if_not_given = "from the noise",
       .help = "A stripe rises this far above the background, in digital numbers of the image",
       .put = [](Options& o, Text v) { o.stripe.threshold_dn = number_of(v); },
       .get = [](const Options& o) { return text_of(o.stripe.threshold_dn); }},
      {.name = "width",
       .unit = "px",
       .words = {},
       .low = 0.0,
       .high = std::numeric_limits<double>::max(),
       .is_low_allowed = false,
       .what_if_not_given = "the model's, else measured",
       .help =
           "The stripe's Gaussian sigma (its width at half its height over 2.35), pixels of the "
           "image",
       .put = [](Options& o, Text v) { o.stripe.stripe_sigma_px = number_of(v); },
       .get = [](const Options& o) { return text_of(o.stripe.stripe_sigma_px); }},
      {.name = "min_confidence",
       .unit = "probability",
       .words = {},
       .low = 0.0,
       .high = 1.0,
       .what_if_not_given = "",
       .help = "Returns that are the stripe with a smaller probability than this are outlier, 0 to "
               "1",
       .put = [](Options& o, Text v) { o.stripe.min_confidence = number_of(v); },
       .get = [](const Options& o) { return fmt::format("{}", o.stripe.min_confidence); }},
      {.name = "min_range",
       .unit = "m",
       .words = {},
       .what_if_not_given = "none",
       .help = "Nearer returns are out_of_range, metres",
       .put = [](Options& o, Text v) { o.scan.min_range_m = number_of(v); },
       .get = [](const Options& o) { return fmt::format("{}", o.scan.min_range_m); }},
      {.name = "max_range",
       .unit = "m",
       .words = {},
       .what_if_not_given = "none",
       .help = "Farther returns are out_of_range, metres",
       .put = [](Options& o, Text v) { o.scan.max_range_m = number_of(v); },
       .get = [](const Options& o) { return fmt::format("{}", o.scan.max_range_m); }},
  };
}

const std::vector<ScannerOption>& table() {
  static const std::vector<ScannerOption> options = [] {
    std::vector<ScannerOption> all = choices();
    for (auto& more : {numbers(), texts()}) all.insert(all.end(), more.begin(), more.end());
    return all;
  }();
  return options;
}

bool is_same_name(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return (x == '-' ? '_' : x) == (y == '-' ? '_' : y); });
}

}  // namespace

std::string ScannerOption::why_not(std::string_view value) const {
  if (!form.empty()) return why_no_text(value);
  if (!is_number()) {
    if (std::find(words.begin(), words.end(), value) != words.end()) return {};
    return fmt::format("'{}' is none of {}", value, fmt::join(words, ", "));
  }
  const std::optional<double> number = number_in(value);
  const bool is_above = number && (is_low_allowed ? *number >= low : *number > low);
  if (is_above && *number <= high) return {};
  if (unit == "probability") return fmt::format("'{}' is no probability, 0 to 1", value);
  if (std::isfinite(low)) return fmt::format("'{}' is no number above {}", value, low);
  return fmt::format("'{}' is no number", value);
}

std::span<const ScannerOption> scanner_options() { return table(); }

const ScannerOption* find_scanner_option(std::string_view name) {
  for (const ScannerOption& option : table()) {
    if (is_same_name(option.name, name)) return &option;
  }
  return nullptr;
}

void set_scanner_option(ScannerOptions& options, std::string_view name, std::string_view value) {
  const ScannerOption* const option = find_scanner_option(name);
  if (option == nullptr) {
    std::vector<std::string_view> names;
    for (const ScannerOption& one : table()) names.push_back(one.name);
    throw Error(ErrorKind::kUsage,
                fmt::format("option '{}' is none of {}", name, fmt::join(names, ", ")));
  }
  if (const std::string reason = option->why_not(value); !reason.empty()) {
    throw Error(ErrorKind::kUsage, fmt::format("{}: {}", option->name, reason));
  }
  option->put(options, value);
}

}  // namespace striper
