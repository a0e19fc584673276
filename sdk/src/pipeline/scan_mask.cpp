// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/pipeline/scan_mask.hpp>

#include "core/yaml_field.hpp"

namespace striper {
namespace {

using detail::YamlField;

constexpr int kVersion = 1;
constexpr std::size_t kLeastCorners = 3;
constexpr int kLargestSide_px = 1 << 15;

cv::Point2d read_corner(const YamlField& field) {
  const Eigen::VectorXd corner = field.numbers(2, "[x, y]");
  return {corner[0], corner[1]};
}

std::vector<ScanMask::Polygon> read_polygons(const YamlField& mask, std::string_view key) {
  std::vector<ScanMask::Polygon> polygons;
  const auto list = mask.find(key);
  if (!list) return polygons;
  for (const YamlField& one : list->list()) {
    ScanMask::Polygon& polygon = polygons.emplace_back();
    for (const YamlField& corner : one.list()) polygon.push_back(read_corner(corner));
    if (polygon.size() < kLeastCorners) one.refuse("a polygon of three corners or more");
  }
  return polygons;
}

ScanMask read_mask(const std::string& text, const std::string& name) {
  const YamlField file = YamlField::parse(text, {name, {}, detail::UnknownKeys::kRefuse});
  file.require_map({"striper_mask", "pixels", "metres"});
  if (file.at("striper_mask", "the version, 1").whole() != kVersion) {
    file.at("striper_mask", "1").refuse("version 1");
  }
  ScanMask mask;
  mask.name = name;
  mask.pixels = read_polygons(file, "pixels");
  mask.metres = read_polygons(file, "metres");
  for (const ScanMask::Polygon& polygon : mask.pixels) {
    for (const cv::Point2d& corner : polygon) {
      if (std::max(std::abs(corner.x), std::abs(corner.y)) < kLargestSide_px) continue;
      file.at("pixels", "").refuse(fmt::format("pixels within {}", kLargestSide_px));
    }
  }
  return mask;
}

void fill(const ScanMask::Polygon& polygon, cv::Mat& ignored) {
  std::vector<cv::Point> corners;
  for (const cv::Point2d& corner : polygon) {
    corners.emplace_back(cvRound(corner.x), cvRound(corner.y));
  }
  cv::fillPoly(ignored, std::vector{corners}, cv::Scalar(255));
}

// Even-odd rule: how often a ray to the right crosses the polygon's sides.
bool is_inside(const ScanMask::Polygon& polygon, double x, double y) {
  bool inside = false;
  for (std::size_t i = 0, before = polygon.size() - 1; i < polygon.size(); before = i++) {
    const cv::Point2d& a = polygon[i];
    const cv::Point2d& b = polygon[before];
    if ((a.y > y) == (b.y > y)) continue;
    if (x < a.x + (y - a.y) * (b.x - a.x) / (b.y - a.y)) inside = !inside;
  }
  return inside;
}

void ignore_in_plane(const std::vector<ScanMask::Polygon>& polygons, const StriperModel& model,
                     int laser, cv::Mat& ignored) {
  const Triangulator triangulator(model, laser);
  for (int v = 0; v < ignored.rows; ++v) {
    auto* const row = ignored.ptr<std::uint8_t>(v);
    for (int u = 0; u < ignored.cols; ++u) {
      const PlanePoint point = triangulator.triangulate({u, v});
      if (point.status != ReturnStatus::kOk) continue;
      const bool is_in_any = std::any_of(
          polygons.begin(), polygons.end(),
          [&](const ScanMask::Polygon& one) { return is_inside(one, point.x_m, point.y_m); });
      if (is_in_any) row[u] = 255;
    }
  }
}

cv::Size own_size(const ScanMask& mask) {
  if (!mask.image.empty()) return mask.image.size();
  cv::Size size(0, 0);
  for (const ScanMask::Polygon& polygon : mask.pixels) {
    for (const cv::Point2d& corner : polygon) {
      size.width = std::max(size.width, cvRound(corner.x) + 1);
      size.height = std::max(size.height, cvRound(corner.y) + 1);
    }
  }
  return size;
}

}  // namespace

ScanMask load_mask(const std::filesystem::path& path) {
  const std::string name = path.string();
  if (path.extension() == ".yaml" || path.extension() == ".yml") {
    return read_mask(read_text_file(path, "a mask"), name);
  }
  if (!std::filesystem::exists(path)) {
    throw Error(ErrorKind::kNotFound, fmt::format("'{}': no such file", name));
  }
  ScanMask mask;
  mask.name = name;
  mask.image = cv::imread(name, cv::IMREAD_GRAYSCALE);
  if (!mask.image.empty()) return mask;
  throw Error(ErrorKind::kBadFile,
              fmt::format("'{}': neither an image file nor a mask's .yaml file", name));
}

cv::Mat ignored_pixels(const ScanMask& mask, const StriperModel* model, int laser) {
  if (model == nullptr && !mask.metres.empty()) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("'{}': metres: polygons of the scan plane need a model", mask.name));
  }
  const cv::Size size =
      model != nullptr ? cv::Size(model->camera.width(), model->camera.height()) : own_size(mask);
  cv::Mat ignored = cv::Mat::zeros(size, CV_8UC1);
  if (!mask.image.empty()) {
    if (mask.image.size() != size) {
      throw Error(ErrorKind::kBadValue,
                  fmt::format("'{}' has {}x{} pixels, and the model's sensor {}x{}", mask.name,
                              mask.image.cols, mask.image.rows, size.width, size.height));
    }
    ignored = mask.image == 0;
  }
  for (const ScanMask::Polygon& polygon : mask.pixels) fill(polygon, ignored);
  if (!mask.metres.empty()) ignore_in_plane(mask.metres, *model, laser, ignored);
  return ignored;
}

}  // namespace striper
