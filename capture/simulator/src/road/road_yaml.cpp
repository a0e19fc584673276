// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/road/road.hpp>

#include "core/yaml_field.hpp"

namespace striper {
namespace {

using detail::YamlField;

template <typename Item, typename Read>
void read_list(const YamlField& root, std::string_view key, std::vector<Item>& items, Read read) {
  const auto list = root.find(key);
  if (!list) return;
  items.clear();
  for (const YamlField& field : list->list()) items.push_back(read(field));
}

RoadBend read_bend(const YamlField& field) {
  field.require_map({"length_m", "radius_m", "transition_m"});
  RoadBend bend;
  bend.length_m = field.at("length_m", "metres").number();
  field.read("radius_m", bend.radius_m);
  field.read("transition_m", bend.transition_m);
  return bend;
}

RoadSpeed read_speed(const YamlField& field) {
  field.require_map({"at_m", "speed_m_s"});
  RoadSpeed speed;
  field.read("at_m", speed.at_m);
  speed.speed_m_s = field.at("speed_m_s", "metres a second").number();
  return speed;
}

RoadWander read_wander(const YamlField& field) {
  field.require_map({"amplitude_m", "period_m", "phase_deg"});
  RoadWander wander;
  field.read("amplitude_m", wander.amplitude_m);
  field.read("period_m", wander.period_m);
  field.read("phase_deg", wander.phase_rad, kDegree);
  return wander;
}

RoadLine read_line(const YamlField& field) {
  field.require_map(
      {"line", "lateral_m", "width_m", "dash_m", "gap_m", "begin_m", "end_m", "brightness"});
  RoadLine line;
  field.read("line", line.line);
  field.read("lateral_m", line.lateral_m);
  field.read("width_m", line.width_m);
  field.read("dash_m", line.dash_m);
  field.read("gap_m", line.gap_m);
  field.read("begin_m", line.begin_m);
  field.read("end_m", line.end_m);
  field.read("brightness", line.brightness);
  return line;
}

RoadObject read_object(const YamlField& field) {
  field.require_map({"kind", "at_m", "lateral_m", "length_m", "width_m", "brightness"});
  RoadObject object;
  constexpr const char* kKinds = "marker, tape, spot, cross or letter";
  const YamlField kind = field.at("kind", kKinds);
  object.kind = kind.word(kKinds);
  if (object.kind != "marker" && object.kind != "tape" && object.kind != "spot" &&
      object.kind != "cross" && object.kind != "letter") {
    kind.refuse(kKinds);
  }
  object.at_m = field.at("at_m", "metres along the road").number();
  field.read("lateral_m", object.lateral_m);
  field.read("length_m", object.length_m);
  field.read("width_m", object.width_m);
  field.read("brightness", object.brightness);
  return object;
}

RoadStretch read_stretch(const YamlField& field) {
  field.require_map({"from_m", "to_m"});
  return {field.at("from_m", "metres along the road").number(),
          field.at("to_m", "metres along the road").number()};
}

RoadMisalignment read_misalignment(const YamlField& field) {
  field.require_map({"beam", "zero_m", "scale"});
  RoadMisalignment one;
  one.beam = field.at("beam", "a beam of the truck").word("a beam of the truck");
  field.read("zero_m", one.zero_m);
  field.read("scale", one.scale);
  return one;
}

void read_tape(const YamlField& field, RoadTape& tape) {
  field.require_map({"every_m", "x_m", "sigma_m"});
  tape.every_m = field.at("every_m", "metres of the truck's way").number();
  if (const auto list = field.find("x_m")) {
    tape.x_m.clear();
    for (const YamlField& x_m : list->list()) tape.x_m.push_back(x_m.number());
  }
  field.read("sigma_m", tape.sigma_m);
}

void read_wear(const YamlField& field, RoadWear& wear) {
  field.require_map({"edge_sd_m", "edge_length_m", "chunks_per_m", "chunk_depth_m", "end_sd_m"});
  field.read("edge_sd_m", wear.edge_sd_m);
  field.read("edge_length_m", wear.edge_length_m);
  field.read("chunks_per_m", wear.chunks_per_m);
  field.read("chunk_depth_m", wear.chunk_depth_m);
  field.read("end_sd_m", wear.end_sd_m);
}

void read_light(const YamlField& field, RoadLight& light) {
  field.require_map({"paint_dn", "road_dn", "road_texture", "dark_dn", "noise_dn", "sun_dn",
                     "fall_off", "spot_m", "wet_share", "fresh_share"});
  field.read("paint_dn", light.paint_dn);
  field.read("road_dn", light.road_dn);
  field.read("road_texture", light.road_texture);
  field.read("dark_dn", light.dark_dn);
  field.read("noise_dn", light.noise_dn);
  field.read("sun_dn", light.sun_dn);
  field.read("fall_off", light.fall_off);
  field.read("spot_m", light.spot_m);
  field.read("wet_share", light.wet_share);
  field.read("fresh_share", light.fresh_share);
}

void validate_wear(const RoadWear& wear) {
  const auto up_to = [](double value, double most, const char* field, const char* expected) {
    require_value(value >= 0.0 && value <= most, field, value, expected);
  };
  up_to(wear.edge_sd_m, 1.0, "wear: edge_sd_m", "0 to 1 m");
  require_value(wear.edge_length_m > 0.0, "wear: edge_length_m", wear.edge_length_m, "above 0");
  up_to(wear.chunks_per_m, 100.0, "wear: chunks_per_m", "0 to 100");
  up_to(wear.chunk_depth_m, 1.0, "wear: chunk_depth_m", "0 to 1 m");
  up_to(wear.end_sd_m, 10.0, "wear: end_sd_m", "0 to 10 m");
}

}  // namespace

void Road::validate() const {
  require_value(length_m > 0.0 && length_m <= 1e5, "length_m", length_m, "above 0, up to 100000 m");
  if (speeds.empty()) throw Error(ErrorKind::kBadValue, "speeds is empty; expected one or more");
  for (const RoadSpeed& one : speeds) {
    require_value(one.speed_m_s >= 0.1 && one.speed_m_s <= 60.0, "speeds: speed_m_s", one.speed_m_s,
                  "0.1 to 60 m/s");
  }
  for (const RoadBend& one : course) {
    require_value(one.length_m > 0.0, "course: length_m", one.length_m, "above 0");
    require_value(one.transition_m >= 0.0 && one.transition_m <= one.length_m,
                  "course: transition_m", one.transition_m, "0 up to length_m");
    require_value(one.radius_m == 0.0 || std::abs(one.radius_m) >= 5.0, "course: radius_m",
                  one.radius_m, "0 (straight), or 5 m and more");
  }
  for (const RoadWander& one : wander) {
    require_value(one.period_m >= 1.0, "wander: period_m", one.period_m, "1 m and more");
    require_value(std::abs(one.amplitude_m) <= 2.0, "wander: amplitude_m", one.amplitude_m,
                  "2 m at most");
  }
  for (const RoadLine& one : lines) {
    require_value(one.width_m > 0.0 && one.width_m <= 1.0, "lines: width_m", one.width_m,
                  "0 to 1 m");
    require_value(one.dash_m >= 0.0, "lines: dash_m", one.dash_m, "0 or more");
    require_value(one.gap_m >= 0.0, "lines: gap_m", one.gap_m, "0 or more");
    require_value(one.line >= -1 && one.line <= 1, "lines: line", one.line, "-1, 0 or 1");
  }
  validate_wear(wear);
  require_value(light.spot_m > 0.0, "light: spot_m", light.spot_m, "above 0");
  require_value(odometer_rate_hz >= 1.0 && odometer_rate_hz <= 1e5, "odometer_rate_hz",
                odometer_rate_hz, "1 to 100000");
  truck.validate();
  for (const RoadMisalignment& one : misaligned) {
    require_value(std::abs(one.zero_m) <= 1.0, "misaligned: zero_m", one.zero_m, "1 m at most");
    require_value(one.scale >= 0.5 && one.scale <= 2.0, "misaligned: scale", one.scale, "0.5 to 2");
  }
  require_value(tape.every_m >= 0.0 && tape.sigma_m >= 0.0, "tape: every_m", tape.every_m,
                "0 or more, and so sigma_m");
}

Road parse_road(const std::string& text, const std::string& name) {
  const YamlField root = YamlField::parse(text, {name, {}, detail::UnknownKeys::kRefuse});
  root.require_map({"striper_road", "seed", "length_m", "course", "speed_m_s", "speeds", "wander",
                    "lines", "wear", "objects", "wet", "shadows", "light", "odometer_rate_hz",
                    "yaw_rate_sigma_rad_s", "truck", "misaligned", "tape"});
  root.at("striper_road", "1").whole(1, 1, "the format's version");
  Road road;
  if (const auto seed = root.find("seed")) {
    road.seed = static_cast<std::uint64_t>(seed->whole(0, 2'000'000'000, "a seed"));
  }
  road.length_m = root.at("length_m", "metres").number();
  read_list(root, "course", road.course, read_bend);
  if (const auto speed = root.find("speed_m_s")) road.speeds = {{0.0, speed->number()}};
  read_list(root, "speeds", road.speeds, read_speed);
  read_list(root, "wander", road.wander, read_wander);
  read_list(root, "lines", road.lines, read_line);
  if (const auto wear = root.find("wear")) read_wear(*wear, road.wear);
  read_list(root, "objects", road.objects, read_object);
  read_list(root, "wet", road.wet, read_stretch);
  read_list(root, "shadows", road.shadows, read_stretch);
  if (const auto light = root.find("light")) read_light(*light, road.light);
  root.read("odometer_rate_hz", road.odometer_rate_hz);
  root.read("yaw_rate_sigma_rad_s", road.yaw_rate_sigma_rad_s);
  if (const auto truck = root.find("truck")) {
    const std::filesystem::path file = truck->word("a guidance.yaml beside this file");
    road.truck = load_guidance(std::filesystem::path(name).parent_path() / file);
  }
  read_list(root, "misaligned", road.misaligned, read_misalignment);
  if (const auto tape = root.find("tape")) read_tape(*tape, road.tape);
  try {
    road.validate();
  } catch (const Error& error) {
    throw Error(ErrorKind::kBadFile, fmt::format("{}: {}", name, error.what()));
  }
  return road;
}

Road load_road(const std::filesystem::path& path) {
  return parse_road(read_text_file(path, "a road"), path.string());
}

}  // namespace striper
