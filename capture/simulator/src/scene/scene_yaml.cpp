// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/simulator/scene_yaml.hpp>

#include "core/yaml_field.hpp"
#include "scene/scene_violation.hpp"

namespace striper {
namespace {

using detail::YamlField;

template <typename Value, std::size_t kCount>
Value choice(const YamlField& field,
             const std::array<std::pair<std::string_view, Value>, kCount>& choices) {
  std::string expected;
  for (const auto& [name, _] : choices) {
    expected += expected.empty() ? "" : ", ";
    expected += name;
  }
  const std::string word = field.word(expected);
  for (const auto& [name, value] : choices) {
    if (word == name) return value;
  }
  field.refuse(expected);
}

constexpr std::array<std::pair<std::string_view, ScanMode>, 5> kScans = {{
    {"progressive", ScanMode::kProgressive},
    {"top-first", ScanMode::kTopFirst},
    {"bottom-first", ScanMode::kBottomFirst},
    {"alternate-top-first", ScanMode::kAlternateTopFirst},
    {"alternate-bottom-first", ScanMode::kAlternateBottomFirst},
}};

Eigen::Matrix3d read_rotation(const YamlField& parent) {
  const auto field = parent.find("rotation_deg");
  if (!field) return Eigen::Matrix3d::Identity();
  const Eigen::Vector3d rpy =
      kDegree * field->numbers(3, "three angles [roll, pitch, yaw] in degrees");
  return rotation_from_rpy(rpy.x(), rpy.y(), rpy.z());
}

/// Runs something that refuses values by itself, and adds the place to what it says.
template <typename Make>
auto at_field(const YamlField& field, const Make& make) {
  try {
    return make();
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::kBadFile) throw;
    const std::string_view what = error.what();
    const std::string path = field.path() + ": ";
    throw Error(ErrorKind::kBadFile,
                fmt::format("{}: {}{}", field.where(), what.starts_with(path) ? "" : path, what));
  }
}

CameraModel read_camera(const YamlField& field) {
  int width = 640;
  int height = 480;
  field.read("width", width);
  field.read("height", height);
  const LensModel lens = [&] {
    const auto word = field.find("lens");
    if (!word) return LensModel::kPlumbBob;
    constexpr std::string_view kExpected = "plumb_bob, rational_polynomial or equidistant";
    const auto found = lens_model_from_string(word->word(kExpected));
    if (!found) word->refuse(kExpected);
    return *found;
  }();
  std::vector<double> distortion(static_cast<std::size_t>(distortion_count(lens)), 0.0);
  if (const auto list = field.find("distortion")) {
    const std::string expected = fmt::format("{} numbers", distortion.size());
    const Eigen::VectorXd k = list->numbers(distortion.size(), expected);
    distortion.assign(k.begin(), k.end());
  }
  double fov_deg = 55.0;
  field.read("fov_deg", fov_deg);
  const CameraModel plain = at_field(field, [&] {
    return lens == LensModel::kEquidistant ? Scene::fisheye(width, height, fov_deg)
                                           : Scene::pinhole(width, height, fov_deg);
  });
  Eigen::Vector2d focal(plain.fx(), plain.fy());
  Eigen::Vector2d center(plain.cx(), plain.cy());
  if (const auto list = field.find("focal_px")) focal = list->numbers(2, "two numbers [fx, fy]");
  if (const auto list = field.find("center_px")) center = list->numbers(2, "two numbers [cx, cy]");
  return at_field(field, [&] {
    return CameraModel(width, height, focal.x(), focal.y(), center.x(), center.y(), lens,
                       distortion);
  });
}

std::vector<int> read_pixels(const YamlField& field, std::size_t count, std::string_view expected) {
  constexpr int kMost = 1'000'000;
  std::vector<int> pixels;
  for (const YamlField& element : field.list(count, expected)) {
    pixels.push_back(element.whole(-kMost, kMost));
  }
  return pixels;
}

void read_imager(const YamlField& field, Imager& imager) {
  field.require_map({"pixel_pitch_um", "f_number", "lens_transmission", "falloff_exponent",
                     "blur_px", "quantum_efficiency", "filter", "shutter_us", "bits",
                     "dn_per_electron", "black_level_dn", "full_well_e", "bloom", "region",
                     "binning"});
  field.read("pixel_pitch_um", imager.pixel_pitch_m, 1e-6);
  field.read("f_number", imager.f_number);
  field.read("lens_transmission", imager.lens_transmission);
  field.read("falloff_exponent", imager.falloff_exponent);
  field.read("blur_px", imager.blur_sigma_px);
  field.read("quantum_efficiency", imager.quantum_efficiency);
  if (const auto filter = field.find("filter")) {
    filter->require_map({"center_nm", "width_nm", "transmission"});
    filter->read("center_nm", imager.filter.center_nm);
    filter->read("width_nm", imager.filter.width_nm);
    filter->read("transmission", imager.filter.transmission);
  }
  field.read("shutter_us", imager.shutter_s, 1e-6);
  field.read("bits", imager.bit_depth);
  field.read("dn_per_electron", imager.dn_per_electron);
  field.read("black_level_dn", imager.black_level_dn);
  field.read("full_well_e", imager.full_well_e);
  if (const auto bloom = field.find("bloom")) {
    bloom->require_map({"fraction", "sigma_px"});
    bloom->read("fraction", imager.bloom.fraction);
    bloom->read("sigma_px", imager.bloom.sigma_px);
  }
  if (const auto region = field.find("region")) {
    const auto r = read_pixels(*region, 4, "four whole numbers [left, top, width, height]");
    imager.region = cv::Rect(r[0], r[1], r[2], r[3]);
  }
  if (const auto binning = field.find("binning")) {
    const auto b = read_pixels(*binning, 2, "two whole numbers [across, down]");
    imager.binning = cv::Size(b[0], b[1]);
  }
}

void read_noise(const YamlField& field, Scene& scene) {
  field.require_map({"shot", "read_e", "prnu", "speckle", "seed"});
  SensorNoise& noise = scene.imager.noise;
  field.read("shot", noise.shot);
  field.read("read_e", noise.read_noise_e);
  field.read("prnu", noise.prnu);
  field.read("speckle", noise.speckle);
  int seed = static_cast<int>(scene.seed);
  field.read("seed", seed);
  scene.seed = static_cast<std::uint64_t>(seed);
}

void read_timing(const YamlField& field, Timing& timing) {
  field.require_map({"picture_rate_hz", "scan", "cadence"});
  field.read("picture_rate_hz", timing.picture_rate_hz);
  if (const auto scan = field.find("scan")) timing.scan = choice(*scan, kScans);
  if (const auto pattern = field.find("cadence")) {
    timing.pattern = at_field(*pattern, [&] {
      return IlluminationPattern::parse(pattern->word("a pattern such as '0,dark'"));
    });
  }
}

SimulatedLaser read_laser(const YamlField& field, const Imager& imager) {
  field.require_map({"position_m", "rotation_deg", "fan_deg", "thickness_deg", "thickness_mm",
                     "focus_m", "wavelength_nm", "pulse_uj", "power_mw"});
  SimulatedLaser laser;
  Eigen::Vector3d position = laser.T_device_laser.translation();
  field.read("position_m", position);
  laser.T_device_laser.translation() = position;
  laser.T_device_laser.linear() = read_rotation(field);
  field.read("fan_deg", laser.fan_rad, kDegree);
  field.read("thickness_deg", laser.divergence_sigma_rad,
             SimulatedLaser::thickness_to_sigma(kDegree));
  field.read("thickness_mm", laser.waist_sigma_m, SimulatedLaser::thickness_to_sigma(1e-3));
  field.read("focus_m", laser.focus_m);
  field.read("wavelength_nm", laser.wavelength_nm);
  field.read("pulse_uj", laser.pulse_energy_j, 1e-6);
  if (const auto power = field.find("power_mw")) {
    if (field.find("pulse_uj")) power->refuse("either pulse_uj or power_mw, not both");
    constexpr double kMostPowerMw = 1e9;
    const double power_mw = power->number();
    if (!(power_mw >= 0.0 && power_mw <= kMostPowerMw)) power->refuse("a number from 0 to 1e9");
    laser.pulse_energy_j = 1e-3 * power_mw * imager.shutter_s;
    laser.is_continuous = true;
  }
  return laser;
}

void read_daylight(const YamlField& field, Daylight& light) {
  field.require_map({"sun_w_m2_nm", "sun_azimuth_deg", "sun_elevation_deg", "shadows",
                     "sky_w_m2_nm", "ambient_w_m2_nm", "sky_radiance_w_m2_sr_nm"});
  field.read("sun_w_m2_nm", light.sun_w_m2_nm);
  if (field.find("sun_azimuth_deg") || field.find("sun_elevation_deg")) {
    const Eigen::Vector3d before = light.sun_direction.normalized();
    double azimuth = std::atan2(before.y(), before.x());
    double elevation = std::asin(before.z());
    field.read("sun_azimuth_deg", azimuth, kDegree);
    field.read("sun_elevation_deg", elevation, kDegree);
    light.sun_direction = {std::cos(elevation) * std::cos(azimuth),
                           std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
  }
  field.read("shadows", light.shadows);
  field.read("sky_w_m2_nm", light.sky_w_m2_nm);
  field.read("ambient_w_m2_nm", light.ambient_w_m2_nm);
  field.read("sky_radiance_w_m2_sr_nm", light.sky_radiance_w_m2_sr_nm);
}

void read_motion(const YamlField& field, SteadyMotion& motion) {
  field.read("velocity_m_s", motion.velocity_m_s);
  field.read("angular_velocity_deg_s", motion.angular_velocity_rad_s, kDegree);
}

Eigen::Isometry3d read_pose(const YamlField& field) {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  field.read("position_m", position);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = position;
  pose.linear() = read_rotation(field);
  if (const auto normal = field.find("normal")) {
    if (field.find("rotation_deg")) normal->refuse("either normal or rotation_deg, not both");
    const Eigen::Vector3d direction = normal->numbers(3, "a direction [x, y, z]");
    if (direction.isZero(0.0))
      normal->refuse("[0, 0, 0]", "a direction [x, y, z] that is not zero");
    pose.linear() = facing(direction);
  }
  return pose;
}

Checkerboard read_checkerboard(const YamlField& field) {
  field.require_map({"columns", "rows", "square_m", "border_m", "black", "white"});
  Checkerboard board;
  field.read("columns", board.columns);
  field.read("rows", board.rows);
  field.read("square_m", board.square_m);
  board.border_m = board.square_m;
  field.read("border_m", board.border_m);
  field.read("black", board.black);
  field.read("white", board.white);
  return board;
}

void read_retro(const YamlField& parent, double& gain, double& spread_rad) {
  const auto field = parent.find("retro");
  if (!field) return;
  field->require_map({"gain", "spread_deg"});
  field->read("gain", gain);
  field->read("spread_deg", spread_rad, kDegree);
}

PaintedStripe read_painted_stripe(const YamlField& field) {
  field.require_map(
      {"width_m", "offset_m", "dash_m", "gap_m", "reflectance", "wear", "grain_m", "retro"});
  PaintedStripe stripe;
  field.read("width_m", stripe.width_m);
  field.read("offset_m", stripe.offset_m);
  field.read("dash_m", stripe.dash_m);
  field.read("gap_m", stripe.gap_m);
  field.read("reflectance", stripe.reflectance);
  field.read("wear", stripe.wear);
  field.read("grain_m", stripe.grain_m);
  read_retro(field, stripe.retro_gain, stripe.retro_spread_rad);
  return stripe;
}

WoodGrain read_wood(const YamlField& field) {
  field.require_map({"fibre_m", "length_m", "direction_deg", "dark", "light"});
  WoodGrain grain;
  field.read("fibre_m", grain.fibre_m);
  field.read("length_m", grain.length_m);
  field.read("direction_deg", grain.direction_rad, kDegree);
  field.read("dark", grain.dark);
  field.read("light", grain.light);
  return grain;
}

Poster read_poster(const YamlField& field) {
  field.require_map({"cell_m", "darkest", "lightest", "seed"});
  Poster poster;
  field.read("cell_m", poster.cell_m);
  field.read("darkest", poster.darkest);
  field.read("lightest", poster.lightest);
  field.read("seed", poster.seed);
  return poster;
}

Shape read_shape(const YamlField& field) {
  constexpr std::string_view kShapes = "plane, rectangle, disc, box, cylinder or sweep";
  const YamlField kind = field.at("shape", kShapes);
  const std::string word = kind.word(kShapes);
  if (word == "plane") return Plane{};
  if (word == "rectangle") {
    const Eigen::Vector2d size =
        field.at("size_m", "[width, height]").numbers(2, "[width, height]");
    return Rectangle{size.x(), size.y()};
  }
  if (word == "disc") return Disc{field.at("radius_m", "a length").number()};
  if (word == "box") {
    return Box{field.at("size_m", "[along x, y, z]").numbers(3, "[along x, y, z]")};
  }
  if (word == "cylinder") {
    return Cylinder{field.at("radius_m", "a length").number(),
                    field.at("length_m", "a length").number()};
  }
  if (word != "sweep") kind.refuse(kShapes);
  Sweep sweep;
  for (const YamlField& point :
       field.at("profile_m", "a list of points [y, z]").list({}, "a list of points [y, z]")) {
    sweep.profile_m.emplace_back(point.numbers(2, "a point [y, z]"));
  }
  field.read("length_m", sweep.length_m);
  return sweep;
}

void read_texture(const YamlField& field, Material& material) {
  const auto read = [&](const char* key, const auto& reader) {
    const auto texture = field.find(key);
    if (!texture) return;
    if (!std::holds_alternative<std::monostate>(material.texture)) {
      texture->refuse("one texture: either checkerboard or stripe, wood or poster, not both");
    }
    material.texture = reader(*texture);
  };
  read("checkerboard", read_checkerboard);
  read("stripe", read_painted_stripe);
  read("wood", read_wood);
  read("poster", read_poster);
}

SceneObject read_object(const YamlField& field) {
  field.require_map({"name", "shape", "size_m", "radius_m", "length_m", "profile_m", "position_m",
                     "rotation_deg", "normal", "velocity_m_s", "angular_velocity_deg_s",
                     "reflectance", "retro", "radiance_w_m2_sr_nm", "mottle", "checkerboard",
                     "stripe", "wood", "poster"});
  SceneObject object;
  object.shape = read_shape(field);
  object.name = field.path();
  if (const auto name = field.find("name")) object.name = name->word("a name");
  object.T_world_object = read_pose(field);
  read_motion(field, object.motion);
  Material& material = object.material;
  field.read("reflectance", material.reflectance);
  read_retro(field, material.retro_gain, material.retro_spread_rad);
  field.read("radiance_w_m2_sr_nm", material.radiance_w_m2_sr_nm);
  if (const auto mottle = field.find("mottle")) {
    mottle->require_map({"contrast", "grain_m"});
    mottle->read("contrast", material.mottle_contrast);
    mottle->read("grain_m", material.mottle_grain_m);
  }
  read_texture(field, material);
  return object;
}

void read_version(const YamlField& root) {
  root.at("striper_scene", "1, the version of the format")
      .whole(1, 1, "the version of the format that this program reads");
}

Scene read_scene(const YamlField& root, const std::string& name) {
  root.require_map({"striper_scene", "camera", "imager", "noise", "timing", "stripe_axis", "lasers",
                    "daylight", "device", "objects", "edge_distance_px"});
  read_version(root);
  Scene scene;
  scene.name = name;
  if (const auto camera = root.find("camera")) {
    camera->require_map({"width", "height", "fov_deg", "focal_px", "center_px", "lens",
                         "distortion", "rotation_deg"});
    scene.camera = read_camera(*camera);
    scene.camera_rotation = read_rotation(*camera);
  }
  if (const auto imager = root.find("imager")) read_imager(*imager, scene.imager);
  if (const auto noise = root.find("noise")) read_noise(*noise, scene);
  if (const auto timing = root.find("timing")) read_timing(*timing, scene.timing);
  if (const auto axis = root.find("stripe_axis")) {
    const auto found = stripe_axis_from_string(axis->word("columns or rows"));
    if (!found) axis->refuse("columns or rows");
    scene.axis = *found;
  }
  if (const auto lasers = root.find("lasers")) {
    scene.lasers.clear();
    for (const YamlField& laser : lasers->list({}, "a list of lasers")) {
      scene.lasers.push_back(read_laser(laser, scene.imager));
    }
  }
  if (const auto daylight = root.find("daylight")) read_daylight(*daylight, scene.daylight);
  if (const auto device = root.find("device")) {
    device->require_map({"position_m", "rotation_deg", "velocity_m_s", "angular_velocity_deg_s"});
    scene.T_world_device = read_pose(*device);
    read_motion(*device, scene.device_motion);
  }
  if (const auto objects = root.find("objects")) {
    for (const YamlField& object : objects->list({}, "a list of objects")) {
      scene.objects.push_back(read_object(object));
    }
  }
  root.read("edge_distance_px", scene.edge_distance_px);
  return scene;
}

}  // namespace

Scene parse_scene(const std::string& yaml, const std::string& name) {
  const YamlField root = YamlField::parse(yaml, {name, {}, detail::UnknownKeys::kRefuse});
  Scene scene = read_scene(root, name);
  try {
    scene.validate();
  } catch (const detail::SceneViolation& bad) {
    throw Error(ErrorKind::kBadFile,
                fmt::format("{}: {}", root.descend(bad.field()).where(), bad.what()));
  }
  return scene;
}

Scene load_scene(const std::filesystem::path& path) {
  const std::string text = read_text_file(path, "a scene; some to start from are in data/scenes/");
  return parse_scene(text, path.string());
}

}  // namespace striper
