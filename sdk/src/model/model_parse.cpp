// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/model/model_yaml.hpp>

#include "core/yaml_field.hpp"
#include "model/model_checks.hpp"
#include "model/quality_text.hpp"
#include "model/stripe_block.hpp"

namespace striper {
namespace {

using detail::YamlField;

constexpr int kVersion = 1;
constexpr int kMaxImageSize = 100'000;
constexpr int kMaxLasers = 64;
constexpr std::size_t kMaxParameters = 12 + 4 * kMaxLasers;

double read_focal_length(const YamlField& element) {
  const double value = element.number();
  if (!(value > 0.0)) element.refuse("a focal length in pixels, above 0");
  return value;
}

Eigen::Vector4d read_camera_matrix(const YamlField& field) {
  const Eigen::Matrix3d K = field.matrix(3, 3);
  const auto elements = field.at("data", "a list of 9").list(9);
  const double fx = read_focal_length(elements[0]);
  const double fy = read_focal_length(elements[4]);
  Eigen::Matrix3d expected = Eigen::Matrix3d::Identity();
  expected.diagonal() << fx, fy, 1.0;
  expected.col(2).head<2>() = K.col(2).head<2>();
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i / 3);
    const auto col = static_cast<Eigen::Index>(i % 3);
    if (K(row, col) != expected(row, col)) {
      elements[i].refuse(
          fmt::format("{}: the matrix is [fx, 0, cx, 0, fy, cy, 0, 0, 1]", expected(row, col)));
    }
  }
  return {fx, fy, K(0, 2), K(1, 2)};
}

LensModel read_lens(const YamlField& field) {
  constexpr std::string_view kExpected = "plumb_bob, rational_polynomial or equidistant";
  const auto lens = lens_model_from_string(field.word(kExpected));
  if (!lens) field.refuse(kExpected);
  return *lens;
}

CameraModel read_camera(const YamlField& field) {
  field.require_map({"image_width", "image_height", "camera_matrix", "distortion_model",
                     "distortion_coefficients"});
  const int width = field.at("image_width", "a number of pixels").whole(1, kMaxImageSize);
  const int height = field.at("image_height", "a number of pixels").whole(1, kMaxImageSize);
  const Eigen::Vector4d K = read_camera_matrix(field.at("camera_matrix", "{rows, cols, data}"));
  const LensModel lens =
      read_lens(field.at("distortion_model", "plumb_bob, rational_polynomial or equidistant"));
  const std::string meaning = fmt::format("the coefficients of {}", to_string(lens));
  const Eigen::VectorXd k = field.at("distortion_coefficients", "{rows, cols, data}")
                                .matrix(1, distortion_count(lens), meaning)
                                .row(0);
  try {
    return {width, height, K[0], K[1], K[2], K[3], lens, {k.begin(), k.end()}};
  } catch (const Error& error) {
    throw Error(ErrorKind::kBadFile, fmt::format("{}: {}", field.where(), error.what()));
  }
}

Laser read_laser(const YamlField& field) {
  field.require_map({"normal", "distance_m", "homography", "T_cam_scan"});
  const YamlField normal = field.at("normal", "[nx, ny, nz]");
  const Eigen::Vector3d n = normal.numbers(3);
  const double d = field.at("distance_m", "a number of metres").number("a finite number of metres");
  Laser laser;
  if (!(std::abs(n.norm() - 1.0) <= kUnitNormalTolerance)) {
    const Eigen::Vector3d unit = n / n.norm();
    const std::string remedy = unit.allFinite()
                                   ? fmt::format(
                                         "; divided by it, normal: [{:.10g}, {:.10g}, {:.10g}] and "
                                         "distance_m: {:.10g}",
                                         unit.x(), unit.y(), unit.z(), d / n.norm())
                                   : std::string();
    normal.refuse(fmt::format("[{}, {}, {}], of length {}", n.x(), n.y(), n.z(), n.norm()),
                  fmt::format("length 1 to {}{}", kUnitNormalTolerance, remedy));
  }
  laser.plane = LaserPlane(n, d);
  if (const auto homography = field.find("homography")) laser.homography = homography->matrix(3, 3);
  if (const auto T_cam_scan = field.find("T_cam_scan")) {
    const Eigen::Matrix4d T = T_cam_scan->matrix(4, 4);
    if (T.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)) {
      T_cam_scan->refuse("a matrix with another last row", "[0, 0, 0, 1] as the last row");
    }
    laser.moved_T_cam_scan.emplace(T);
  }
  return laser;
}

std::vector<Laser> read_lasers(const YamlField& field) {
  const std::vector<YamlField> fields = field.list();
  if (fields.size() > kMaxLasers) field.refuse(fmt::format("at most {} lasers", kMaxLasers));
  std::vector<Laser> lasers;
  std::transform(fields.begin(), fields.end(), std::back_inserter(lasers), read_laser);
  return lasers;
}

NoiseModel read_noise(const YamlField& field) {
  field.require_map({"read_noise_dn", "dn_per_electron", "black_level_dn", "bit_depth"});
  NoiseModel noise;
  noise.read_noise_dn = field.at("read_noise_dn", "a number").number();
  noise.dn_per_electron = field.at("dn_per_electron", "a number").number();
  if (const auto black = field.find("black_level_dn")) noise.black_level_dn = black->number();
  if (const auto depth = field.find("bit_depth")) noise.bit_depth = depth->whole(8, 16);
  return noise;
}

ModelCovariance read_covariance(const YamlField& field) {
  field.require_map({"parameters", "rows", "cols", "data"});
  ModelCovariance covariance;
  const YamlField names = field.at("parameters", "a list of names");
  if (names.node().size() > kMaxParameters) names.refuse(fmt::format("at most {}", kMaxParameters));
  for (const YamlField& name : names.list()) {
    covariance.parameters.push_back(name.word("the name of a parameter"));
  }
  const auto size = covariance.parameters.size();
  const int n = static_cast<int>(size);
  field.at("rows", "the number of parameters").whole(n, n);
  field.at("cols", "the number of parameters").whole(n, n);
  const Eigen::VectorXd data = field.at("data", "a list of numbers").numbers(size * size);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  covariance.matrix = Eigen::Map<const RowMajor>(data.data(), n, n);
  return covariance;
}

// A plane that the file gives with distance_m below 0 has been turned round; what varies with it
// turns too.
void turn_with_planes(const YamlField& lasers, ModelCovariance& covariance) {
  const std::vector<YamlField> planes = lasers.list();
  for (std::size_t laser = 0; laser < planes.size(); ++laser) {
    if (!(planes[laser].at("distance_m", "a number of metres").number() < 0.0)) continue;
    const std::string prefix = fmt::format("laser{}_", laser);
    for (std::size_t i = 0; i < covariance.parameters.size(); ++i) {
      if (!covariance.parameters[i].starts_with(prefix)) continue;
      covariance.matrix.row(static_cast<Eigen::Index>(i)) *= -1.0;
      covariance.matrix.col(static_cast<Eigen::Index>(i)) *= -1.0;
    }
  }
}

void warn_of_fold(const CameraModel& camera, const YamlField& field) {
  if (!camera.folds_inside_image()) return;
  constexpr double kDegrees = 57.29577951308232;
  field.events().send(
      {"lens_folds",
       fmt::format("{}: the distortion folds back inside the image: it is one-to-one only up to "
                   "{:.1f} degrees from the optical axis, and pixels beyond have no ray",
                   field.where(), camera.max_theta_rad() * kDegrees)});
}

// Whether any pixel looks at the plane in front of the camera; n . r is largest on a border, but
// for what a lens bends in between.
bool is_seen(const LaserPlane& plane, const CameraModel& camera) {
  constexpr int kSteps = 32;
  const double right = camera.width() - 1;
  const double bottom = camera.height() - 1;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Unprojection ray = camera.unproject({right * i / kSteps, bottom * j / kSteps});
      if (ray.status == CameraStatus::kOk && plane.normal().dot(ray.xy.homogeneous()) > 0.0)
        return true;
    }
  }
  return false;
}

void warn_of_unseen_planes(const StriperModel& model, const YamlField& lasers) {
  const std::vector<YamlField> planes = lasers.list();
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (is_seen(model.lasers[i].plane, model.camera)) continue;
    lasers.events().send(
        {"plane_unseen",
         fmt::format("{}: lasers[{}]: no pixel sees this plane in front of the camera, so it will "
                     "give no range; are normal and distance_m in the camera's frame (x right, y "
                     "down, z forward)?",
                     planes[i].where(), i)});
  }
}

StriperModel read_model(const YamlField& root, const std::string& yaml) {
  root.require_map(
      {"striper_model", "camera", "lasers", "stripe", "noise", "covariance", "quality"});
  root.at("striper_model", "the version of the format, 1")
      .whole(kVersion, kVersion, "the version of the format that this program reads");
  StriperModel model;
  const YamlField camera = root.at("camera", "a map");
  model.camera = read_camera(camera);
  const YamlField lasers = root.at("lasers", "a list, [] for a camera alone");
  model.lasers = read_lasers(lasers);
  detail::read_stripe(root.at("stripe", "a map with axis, channel"), model);
  if (const auto noise = root.find("noise")) model.noise = read_noise(*noise);
  if (const auto covariance = root.find("covariance")) {
    model.covariance = read_covariance(*covariance);
    turn_with_planes(lasers, *model.covariance);
  }
  if (const auto quality = root.find("quality")) {
    if (!quality->node().IsMap()) quality->refuse("a map");
    model.quality_yaml = detail::quality_text(yaml, root.node());
  }
  if (const auto bad = detail::find_violation(model)) {
    root.descend(bad->field).refuse(bad->value, bad->expected);
  }
  warn_of_fold(model.camera, camera);
  warn_of_unseen_planes(model, lasers);
  return model;
}

}  // namespace

StriperModel parse_model(const std::string& yaml, const std::string& name,
                         const EventPort& events) {
  return read_model(YamlField::parse(yaml, {name, events}), yaml);
}

StriperModel load_model(const std::filesystem::path& path, const EventPort& events) {
  return parse_model(read_text_file(path, "a striper model"), path.string(), events);
}

}  // namespace striper
