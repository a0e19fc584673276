// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/intrinsics/camera_file.hpp>
#include <striper/model/model_yaml.hpp>

#include "core/yaml_field.hpp"

namespace striper {
namespace {

using detail::YamlField;

[[noreturn]] void bad_file(const std::filesystem::path& path, const std::string& what) {
  throw Error(ErrorKind::kBadFile, fmt::format("{}: {}", path.string(), what));
}

// What the three kinds of files have in common, once read.
struct RawCamera {
  int width = 0;
  int height = 0;
  std::vector<double> matrix;  // 3x3, row by row.
  std::string distortion_model = "plumb_bob";
  std::vector<double> distortion;
};

LensModel lens_of(const std::filesystem::path& path, const RawCamera& raw) {
  if (raw.distortion_model == "plumb_bob" || raw.distortion_model == "none")
    return raw.distortion.size() > 5 ? LensModel::kRationalPolynomial : LensModel::kPlumbBob;
  if (raw.distortion_model == "rational_polynomial") return LensModel::kRationalPolynomial;
  if (raw.distortion_model == "equidistant" || raw.distortion_model == "fisheye")
    return LensModel::kEquidistant;
  bad_file(path, fmt::format("distortion_model is '{}'; expected plumb_bob, rational_polynomial or "
                             "equidistant",
                             raw.distortion_model));
}

// A camera whose pixels are skewed, or with coefficients that none of our lenses has, is refused
// rather than rounded.
CameraModel make_camera(const std::filesystem::path& path, RawCamera raw) {
  if (raw.matrix.size() != 9)
    bad_file(path, fmt::format("camera matrix has {} numbers; expected 9", raw.matrix.size()));
  if (raw.width <= 0 || raw.height <= 0)
    bad_file(path, "image_width and image_height are missing; add the size of the images");
  if (std::abs(raw.matrix[1]) > 1e-9)
    bad_file(path, fmt::format("camera matrix has a skew of {}; expected 0", raw.matrix[1]));
  const LensModel lens = lens_of(path, raw);
  const auto count = static_cast<std::size_t>(distortion_count(lens));
  for (std::size_t i = count; i < raw.distortion.size(); ++i)
    if (raw.distortion[i] != 0.0)
      bad_file(path, fmt::format("distortion coefficient {} is {}; the {} lens has {}", i,
                                 raw.distortion[i], to_string(lens), count));
  raw.distortion.resize(count, 0.0);
  try {
    return {raw.width,     raw.height,    raw.matrix[0], raw.matrix[4],
            raw.matrix[2], raw.matrix[5], lens,          raw.distortion};
  } catch (const Error& error) {
    bad_file(path, error.what());
  }
}

std::vector<double> ros_numbers(const YamlField& field) {
  const auto data = field.node().IsMap() ? field.at("data", "a list of numbers") : field;
  std::vector<double> numbers;
  for (const YamlField& element : data.list()) numbers.push_back(element.number());
  return numbers;
}

RawCamera read_ros(const YamlField& root) {
  constexpr int kMostPixels = 100'000;
  const auto size = [&](std::string_view key) {
    return root.at(key, "a number of pixels").whole(1, kMostPixels);
  };
  RawCamera raw;
  raw.width = size("image_width");
  raw.height = size("image_height");
  if (const auto model = root.find("distortion_model"))
    raw.distortion_model = model->word("a word");
  raw.matrix = ros_numbers(root.at("camera_matrix", "a matrix with data"));
  if (const auto distortion = root.find("distortion_coefficients")) {
    raw.distortion = ros_numbers(*distortion);
  }
  return raw;
}

std::optional<std::vector<double>> opencv_numbers(const cv::FileStorage& storage,
                                                  std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const cv::FileNode node = storage[name];
    if (node.empty()) continue;
    cv::Mat matrix;
    if (node.isMap())
      node >> matrix;
    else if (node.isSeq()) {
      std::vector<double> numbers;
      node >> numbers;
      return numbers;
    }
    if (matrix.empty()) continue;
    cv::Mat numbers;
    matrix.convertTo(numbers, CV_64F);
    numbers = numbers.clone().reshape(1, 1);
    return std::vector<double>(numbers.begin<double>(), numbers.end<double>());
  }
  return std::nullopt;
}

RawCamera read_opencv(const std::filesystem::path& path, const std::string& text) {
  RawCamera raw;
  try {
    const cv::FileStorage storage(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    const auto matrix = opencv_numbers(
        storage, {"camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M1", "intrinsics"});
    if (!matrix)
      bad_file(path,
               "no camera in it; expected a model of this project, a ROS camera_info, or an OpenCV "
               "file with camera_matrix");
    raw.matrix = *matrix;
    const auto distortion =
        opencv_numbers(storage, {"distortion_coefficients", "dist_coeffs", "distCoeffs",
                                 "Distortion_Coefficients", "D", "D1", "distortion"});
    if (distortion) raw.distortion = *distortion;
    const cv::FileNode model = storage["distortion_model"];
    if (model.isString()) raw.distortion_model = static_cast<std::string>(model);
    const cv::FileNode size = storage["image_size"];
    if (size.isSeq() && size.size() == 2) {
      raw.width = static_cast<int>(size[0]);
      raw.height = static_cast<int>(size[1]);
    } else {
      for (const auto& [width, height] :
           {std::pair{"image_width", "image_height"}, std::pair{"image_Width", "image_Height"}}) {
        if (!storage[width].empty()) raw.width = static_cast<int>(storage[width]);
        if (!storage[height].empty()) raw.height = static_cast<int>(storage[height]);
      }
    }
  } catch (const cv::Exception& error) {
    bad_file(path, fmt::format("it is neither YAML nor an OpenCV file: {}", error.err));
  }
  return raw;
}

bool is_opencv(const std::string& text) {
  return text.rfind("%YAML:1.0", 0) == 0 || text.rfind("<?xml", 0) == 0 ||
         text.find("!!opencv-matrix") != std::string::npos || text.rfind("<opencv_storage", 0) == 0;
}

KnownCamera from_model(const std::filesystem::path& path) {
  const StriperModel model = load_model(path);
  KnownCamera known{model.camera, std::nullopt};
  const auto count = model.camera.parameters().size();
  if (model.covariance && model.covariance->matrix.rows() >= count)
    known.covariance = model.covariance->matrix.topLeftCorner(count, count);
  // All zeros: the camera was itself given without a covariance.
  if (known.covariance && known.covariance->norm() == 0.0) known.covariance.reset();
  return known;
}

}  // namespace

KnownCamera load_camera(const std::filesystem::path& path) {
  const std::string text = read_text_file(
      path, "a model of this project, a ROS camera_info or an OpenCV file with camera_matrix");
  if (is_opencv(text)) return {make_camera(path, read_opencv(path, text)), std::nullopt};
  const YamlField root = YamlField::parse(text, {path.string(), {}});
  if (root.find("striper_model")) return from_model(path);
  if (root.find("camera_matrix")) return {make_camera(path, read_ros(root)), std::nullopt};
  bad_file(
      path,
      "no camera in it; expected a model of this project, a ROS camera_info, or an OpenCV file "
      "with camera_matrix");
}

std::string format_camera_info(const CameraModel& camera, const std::string& camera_name) {
  const auto matrix = [](const char* name, int rows, int columns, const std::vector<double>& data) {
    return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: [{}]\n", name, rows, columns,
                       fmt::join(data, ", "));
  };
  const double fx = camera.fx();
  const double fy = camera.fy();
  const double cx = camera.cx();
  const double cy = camera.cy();
  std::string text = fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n",
                                 camera.width(), camera.height(), camera_name);
  text += matrix("camera_matrix", 3, 3, {fx, 0, cx, 0, fy, cy, 0, 0, 1});
  text += fmt::format("distortion_model: {}\n", to_string(camera.lens()));
  text += matrix("distortion_coefficients", 1, static_cast<int>(camera.distortion().size()),
                 camera.distortion());
  text += matrix("rectification_matrix", 3, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  text += matrix("projection_matrix", 3, 4, {fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0});
  return text;
}

void save_camera_info(const CameraModel& camera, const std::string& camera_name,
                      const std::filesystem::path& path) {
  write_file_atomically(path, format_camera_info(camera, camera_name));
}

}  // namespace striper
