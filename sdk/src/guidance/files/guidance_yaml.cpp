// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/guidance/guidance_config.hpp>

#include "core/yaml_field.hpp"

namespace striper {
namespace {

using detail::YamlField;

constexpr const char* kAuto = "auto";

template <typename Value>
struct Word {
  Value value;
  std::string_view text;
};
template <typename Value>
Word(Value, const char*) -> Word<Value>;

constexpr std::array kKinds{Word{BeamKind::kRetro, "retro"}, Word{BeamKind::kDiffuse, "diffuse"}};
constexpr std::array kUses{Word{BeamUse::kOff, "off"}, Word{BeamUse::kOldOnly, "old-only"},
                           Word{BeamUse::kOn, "on"}};
constexpr std::array kFollows{Word{FollowLine::kSingle, "single"}, Word{FollowLine::kLeft, "left"},
                              Word{FollowLine::kRight, "right"}};
constexpr std::array kPatterns{Word{LinePattern::kAuto, "auto"}, Word{LinePattern::kSolid, "solid"},
                               Word{LinePattern::kDashed, "dashed"},
                               Word{LinePattern::kNone, "none"}};
constexpr std::array kMethods{
    Word{PathMethod::kFilter, "filter"}, Word{PathMethod::kReport, "report"},
    Word{PathMethod::kExponential, "exponential"}, Word{PathMethod::kInteger, "integer"}};
constexpr std::array kActions{Word{FaultAction::kStop, "stop"}, Word{FaultAction::kHold, "hold"},
                              Word{FaultAction::kWarn, "warn"}};

template <typename Words>
auto word_of(const Words& words, const std::string& text) {
  using Value = std::remove_cvref_t<decltype(words[0].value)>;
  for (const auto& word : words) {
    if (word.text == text) return std::optional<Value>(word.value);
  }
  return std::optional<Value>();
}

template <typename Words, typename Value>
std::string_view text_of(const Words& words, Value value) {
  for (const auto& word : words) {
    if (word.value == value) return word.text;
  }
  return {};
}

template <typename Words>
std::string list_of(const Words& words) {
  std::string list;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) list += i + 1 == words.size() ? " or " : ", ";
    list += words[i].text;
  }
  return list;
}

template <typename Words, typename Value>
void read_word(const YamlField& map, std::string_view key, const Words& words, Value& value) {
  const auto field = map.find(key);
  if (!field) return;
  const std::string expected = list_of(words);
  // YAML takes a bare `on` or `off` for text; so does this.
  const auto found = word_of(words, field->word(expected));
  if (!found) field->refuse(expected);
  value = *found;
}

void read_text(const YamlField& map, std::string_view key, std::string& value) {
  if (const auto field = map.find(key)) value = field->word("a name");
}

// A number, or `auto` for one that is found out.
void read_or_auto(const YamlField& map, std::string_view key, double& value) {
  const auto field = map.find(key);
  if (!field) return;
  value = field->node().IsScalar() && field->node().Scalar() == kAuto
              ? std::numeric_limits<double>::quiet_NaN()
              : field->number("a number, or auto");
}

GuidanceBeam read_beam(const YamlField& field) {
  field.require_map({"name", "kind", "x_m", "y_left_m", "y_right_m", "height_m", "fan_deg",
                     "sweep_s", "rate_hz", "samples", "bits", "threshold", "response", "head",
                     "laser", "use", "zero_m", "scale"});
  GuidanceBeam beam;
  beam.name = field.at("name", "the beam's name").word("the beam's name");
  read_word(field, "kind", kKinds, beam.kind);
  beam.x_m = field.at("x_m", "metres forward of the gun").number();
  field.read("y_left_m", beam.y_left_m);
  field.read("y_right_m", beam.y_right_m);
  field.read("height_m", beam.height_m);
  field.read("fan_deg", beam.fan_rad, kDegree);
  field.read("sweep_s", beam.sweep_s);
  field.read("rate_hz", beam.rate_hz);
  field.read("samples", beam.samples);
  field.read("bits", beam.bits);
  read_or_auto(field, "threshold", beam.threshold);
  if (const auto response = field.find("response")) {
    if (!(response->node().IsScalar() && response->node().Scalar() == kAuto)) {
      for (const YamlField& gain : response->list()) beam.response.push_back(gain.number());
    }
  }
  read_text(field, "head", beam.head);
  field.read("laser", beam.laser);
  read_word(field, "use", kUses, beam.use);
  field.read("zero_m", beam.zero_m);
  field.read("scale", beam.scale);
  return beam;
}

GuidanceGun read_gun(const YamlField& field) {
  field.require_map({"name", "line", "x_m", "on_delay_s", "off_delay_s", "on_delay_sd_s",
                     "off_delay_sd_s", "on_advance_m", "off_advance_m"});
  GuidanceGun gun;
  read_text(field, "name", gun.name);
  field.read("line", gun.line);
  field.read("x_m", gun.gun.x_m);
  field.read("on_delay_s", gun.gun.on_delay_s);
  field.read("off_delay_s", gun.gun.off_delay_s);
  field.read("on_delay_sd_s", gun.on_delay_sd_s);
  field.read("off_delay_sd_s", gun.off_delay_sd_s);
  field.read("on_advance_m", gun.gun.on_advance_m);
  field.read("off_advance_m", gun.gun.off_advance_m);
  return gun;
}

GuidanceLine read_line(const YamlField& field) {
  field.require_map({"pattern", "dash_m", "gap_m"});
  GuidanceLine line;
  read_word(field, "pattern", kPatterns, line.pattern);
  read_or_auto(field, "dash_m", line.dash_m);
  read_or_auto(field, "gap_m", line.gap_m);
  return line;
}

void read_stripe(const YamlField& field, GuidanceStripe& stripe) {
  field.require_map({"width_m", "follow", "spacing_m", "lines", "end_extension_m", "dash_min_m",
                     "gap_min_m", "gap_limit_m", "marker_max_m"});
  field.read("width_m", stripe.width_m);
  read_word(field, "follow", kFollows, stripe.follow);
  field.read("spacing_m", stripe.spacing_m);
  if (const auto lines = field.find("lines")) {
    stripe.lines.clear();
    for (const YamlField& line : lines->list()) stripe.lines.push_back(read_line(line));
  }
  field.read("end_extension_m", stripe.end_extension_m);
  field.read("dash_min_m", stripe.dash_min_m);
  field.read("gap_min_m", stripe.gap_min_m);
  field.read("gap_limit_m", stripe.gap_limit_m);
  field.read("marker_max_m", stripe.marker_max_m);
}

void read_faults(const YamlField& field, GuidanceConfig& config) {
  field.require_map({"no_stripe", "beam_silent", "beam_blind", "odometer", "mirror", "laser_off",
                     "time", "queue_full"});
  for (std::size_t i = 0; i < kGuidanceFaults; ++i) {
    read_word(field, to_string(static_cast<GuidanceFault>(i)), kActions, config.faults[i]);
  }
}

// What the rows are of, for who reads the file: BEAM_zero_m, BEAM_scale, ...
std::vector<std::string> alignment_parameters(const GuidanceConfig& config) {
  std::vector<std::string> names;
  for (const GuidanceBeam& beam : config.beams) {
    names.push_back(beam.name + "_zero_m");
    names.push_back(beam.name + "_scale");
  }
  return names;
}

void read_alignment(const YamlField& field, GuidanceConfig& config) {
  field.require_map({"parameters", "covariance"});
  const std::vector<std::string> expected = alignment_parameters(config);
  const YamlField parameters = field.at("parameters", "zero and scale of each beam in turn");
  const std::vector<YamlField> names = parameters.list();
  for (std::size_t i = 0; i < names.size() || i < expected.size(); ++i) {
    if (i >= names.size() || i >= expected.size() || names[i].word("a name") != expected[i]) {
      parameters.refuse(fmt::format("[{}]", fmt::join(expected, ", ")).c_str());
    }
  }
  for (const YamlField& number : field.at("covariance", "its rows in one list").list()) {
    config.alignment_covariance.push_back(number.number());
  }
}

GuidanceConfig read_config(const YamlField& root) {
  root.require_map({"striper_guidance", "beams", "odometer", "guns", "stripe", "output",
                    "smoothing", "faults", "alignment"});
  root.at("striper_guidance", "1").whole(1, 1, "the format's version");
  GuidanceConfig config;
  for (const YamlField& beam : root.at("beams", "a list of beams").list()) {
    config.beams.push_back(read_beam(beam));
  }
  const YamlField odometer = root.at("odometer", "{counts_per_m: K}");
  odometer.require_map({"counts_per_m", "bits", "source"});
  config.odometer.counts_per_m = odometer.at("counts_per_m", "counts in a metre").number();
  odometer.read("bits", config.odometer.bits);
  read_text(odometer, "source", config.odometer_source);
  if (const auto guns = root.find("guns")) {
    for (const YamlField& gun : guns->list()) config.guns.push_back(read_gun(gun));
  }
  if (const auto stripe = root.find("stripe")) read_stripe(*stripe, config.stripe);
  if (const auto output = root.find("output")) {
    output->require_map(
        {"offset_m", "volts_per_m", "volts_min", "volts_max", "volts_safe", "offset_sd_m"});
    output->read("offset_m", config.output.offset_m);
    output->read("volts_per_m", config.output.volts_per_m);
    output->read("volts_min", config.output.volts_min);
    output->read("volts_max", config.output.volts_max);
    output->read("volts_safe", config.output.volts_safe);
    output->read("offset_sd_m", config.output.offset_sd_m);
  }
  if (const auto smoothing = root.find("smoothing")) {
    smoothing->require_map({"method", "alpha"});
    read_word(*smoothing, "method", kMethods, config.smoothing.method);
    smoothing->read("alpha", config.smoothing.alpha);
  }
  if (const auto faults = root.find("faults")) read_faults(*faults, config);
  if (const auto alignment = root.find("alignment")) read_alignment(*alignment, config);
  return config;
}

// A name as YAML's double quotes hold it.
std::string in_quotes(std::string_view name) {
  std::string out = "\"";
  for (const char c : name) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string number_or_auto(double value) {
  return std::isnan(value) ? std::string(kAuto) : fmt::format("{}", value);
}

void format_beam(std::string& out, const GuidanceBeam& beam) {
  auto to = std::back_inserter(out);
  fmt::format_to(to, "  - {{name: {}, kind: {}, x_m: {}, y_left_m: {}, y_right_m: {},\n",
                 in_quotes(beam.name), text_of(kKinds, beam.kind), beam.x_m, beam.y_left_m,
                 beam.y_right_m);
  fmt::format_to(to,
                 "     height_m: {}, fan_deg: {:.12g}, sweep_s: {}, rate_hz: {}, samples: {},\n",
                 beam.height_m, beam.fan_rad / kDegree, beam.sweep_s, beam.rate_hz, beam.samples);
  fmt::format_to(to, "     bits: {}, threshold: {}, response: {},", beam.bits,
                 number_or_auto(beam.threshold),
                 beam.response.empty() ? std::string(kAuto)
                                       : fmt::format("[{}]", fmt::join(beam.response, ", ")));
  if (!beam.head.empty()) fmt::format_to(to, " head: {},", in_quotes(beam.head));
  fmt::format_to(to, " laser: {}, use: {},\n     zero_m: {}, scale: {}}}\n", beam.laser,
                 text_of(kUses, beam.use), beam.zero_m, beam.scale);
}

}  // namespace

GuidanceConfig parse_guidance(const std::string& text, const std::string& name) {
  const YamlField root = YamlField::parse(text, {name, {}, detail::UnknownKeys::kRefuse});
  GuidanceConfig config = read_config(root);
  try {
    config.validate();
  } catch (const Error& error) {
    throw Error(ErrorKind::kBadFile, fmt::format("{}: {}", name, error.what()));
  }
  return config;
}

GuidanceConfig load_guidance(const std::filesystem::path& path, const EventPort& /*events*/) {
  return parse_guidance(read_text_file(path, "a guidance file"), path.string());
}

std::string format_guidance(const GuidanceConfig& config) {
  std::string out = "striper_guidance: 1\nbeams:\n";
  auto to = std::back_inserter(out);
  for (const GuidanceBeam& beam : config.beams) format_beam(out, beam);
  fmt::format_to(to, "odometer: {{counts_per_m: {}, bits: {}", config.odometer.counts_per_m,
                 config.odometer.bits);
  if (!config.odometer_source.empty()) {
    fmt::format_to(to, ", source: {}", in_quotes(config.odometer_source));
  }
  out += "}\n";
  if (!config.guns.empty()) out += "guns:\n";
  for (const GuidanceGun& gun : config.guns) {
    fmt::format_to(to,
                   "  - {{name: {}, line: {}, x_m: {}, on_delay_s: {}, off_delay_s: {},\n"
                   "     on_delay_sd_s: {}, off_delay_sd_s: {}, on_advance_m: {}, "
                   "off_advance_m: {}}}\n",
                   in_quotes(gun.name), gun.line, gun.gun.x_m, gun.gun.on_delay_s,
                   gun.gun.off_delay_s, gun.on_delay_sd_s, gun.off_delay_sd_s, gun.gun.on_advance_m,
                   gun.gun.off_advance_m);
  }
  const GuidanceStripe& stripe = config.stripe;
  fmt::format_to(to, "stripe:\n  width_m: {}\n  follow: {}\n  spacing_m: {}\n  lines:\n",
                 stripe.width_m, text_of(kFollows, stripe.follow), stripe.spacing_m);
  for (const GuidanceLine& line : stripe.lines) {
    fmt::format_to(to, "    - {{pattern: {}, dash_m: {}, gap_m: {}}}\n",
                   text_of(kPatterns, line.pattern), number_or_auto(line.dash_m),
                   number_or_auto(line.gap_m));
  }
  fmt::format_to(to,
                 "  end_extension_m: {}\n  dash_min_m: {}\n  gap_min_m: {}\n  gap_limit_m: {}\n"
                 "  marker_max_m: {}\n",
                 stripe.end_extension_m, stripe.dash_min_m, stripe.gap_min_m, stripe.gap_limit_m,
                 stripe.marker_max_m);
  fmt::format_to(to,
                 "output: {{offset_m: {}, volts_per_m: {}, volts_min: {}, volts_max: {}, "
                 "volts_safe: {},\n         offset_sd_m: {}}}\n",
                 config.output.offset_m, config.output.volts_per_m, config.output.volts_min,
                 config.output.volts_max, config.output.volts_safe, config.output.offset_sd_m);
  fmt::format_to(to, "smoothing: {{method: {}, alpha: {}}}\nfaults: {{",
                 text_of(kMethods, config.smoothing.method), config.smoothing.alpha);
  for (std::size_t i = 0; i < kGuidanceFaults; ++i) {
    fmt::format_to(to, "{}{}: {}", i > 0 ? ", " : "", to_string(static_cast<GuidanceFault>(i)),
                   to_string(config.faults[i]));
  }
  out += "}\n";
  if (config.alignment_covariance.empty()) return out;
  std::vector<std::string> names;
  for (const std::string& name : alignment_parameters(config)) names.push_back(in_quotes(name));
  fmt::format_to(to, "alignment:\n  parameters: [{}]\n  covariance: [{}]\n", fmt::join(names, ", "),
                 fmt::join(config.alignment_covariance, ", "));
  return out;
}

}  // namespace striper
