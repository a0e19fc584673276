// SPDX-License-Identifier: Apache-2.0
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/model/model_yaml.hpp>

#include "model/stripe_block.hpp"

namespace striper {
namespace {

// Shortest decimals that read back as the same bits.
std::string row_text(const Eigen::MatrixXd& M, Eigen::Index row) {
  std::string text;
  for (Eigen::Index col = 0; col < M.cols(); ++col) {
    text += fmt::format("{}{}", col > 0 ? ", " : "", M(row, col));
  }
  return text;
}

// The `data` list of a matrix, a line a row, so that a person can read it.
std::string data_text(const Eigen::MatrixXd& M, std::string_view indentation) {
  std::string text = "[";
  for (Eigen::Index row = 0; row < M.rows(); ++row) {
    if (M.rows() > 1) text += fmt::format("\n{}", indentation);
    text += row_text(M, row) + (row + 1 < M.rows() ? "," : "");
  }
  return text + "]";
}

std::string matrix_text(const Eigen::MatrixXd& M, std::string_view indentation) {
  return fmt::format("{{rows: {}, cols: {}, data: {}}}", M.rows(), M.cols(),
                     data_text(M, indentation));
}

std::string_view coefficients_comment(LensModel lens) {
  switch (lens) {
    case LensModel::kPlumbBob:
      return "k1, k2, p1, p2, k3";
    case LensModel::kRationalPolynomial:
      return "k1, k2, p1, p2, k3, k4, k5, k6";
    case LensModel::kEquidistant:
      break;
  }
  return "k1, k2, k3, k4 in theta";
}

std::string camera_text(const CameraModel& camera) {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K << camera.fx(), 0.0, camera.cx(), 0.0, camera.fy(), camera.cy(), 0.0, 0.0, 1.0;
  const Eigen::RowVectorXd k =
      camera.parameters().tail(distortion_count(camera.lens())).transpose();
  return fmt::format(
      "# The camera, in the keys of ROS camera_info. Pixel (0, 0) is the centre of the top-left "
      "pixel.\n"
      "camera:\n"
      "  image_width: {}\n"
      "  image_height: {}\n"
      "  # fx, 0, cx; 0, fy, cy; 0, 0, 1 in pixels\n"
      "  camera_matrix: {}\n"
      "  distortion_model: {}  # plumb_bob, rational_polynomial or equidistant\n"
      "  # {}\n"
      "  distortion_coefficients: {}\n",
      camera.width(), camera.height(), matrix_text(K, "    "), to_string(camera.lens()),
      coefficients_comment(camera.lens()), matrix_text(k, "    "));
}

std::string laser_text(const Laser& laser) {
  const Eigen::Vector3d& n = laser.plane.normal();
  std::string text = fmt::format("  - normal: [{}, {}, {}]\n    distance_m: {}\n", n.x(), n.y(),
                                 n.z(), laser.plane.distance_m());
  if (laser.homography) {
    text += fmt::format(
        "    # from undistorted rays (x, y, 1) to (X, Y, 1) in the scan frame, up to scale\n"
        "    homography: {}\n",
        matrix_text(*laser.homography, "      "));
  }
  if (laser.moved_T_cam_scan) {
    text += fmt::format(
        "    # the scan frame: p_cam = T_cam_scan * p_scan; its x-y plane is the laser plane\n"
        "    T_cam_scan: {}\n",
        matrix_text(laser.moved_T_cam_scan->matrix(), "      "));
  }
  return text;
}

std::string lasers_text(const std::vector<Laser>& lasers) {
  std::string text =
      "# The planes of laser light, normal . p = distance_m in the camera frame (x right, y down,\n"
      "# z forward, metres). A laser's number is its place in this list, from 0.\n";
  if (lasers.empty()) return text + "lasers: []\n";
  text += "lasers:\n";
  for (const Laser& laser : lasers) text += laser_text(laser);
  return text;
}

std::string noise_text(const NoiseModel& noise) {
  const std::string depth =
      noise.bit_depth ? fmt::format(", bit_depth: {}", *noise.bit_depth) : std::string();
  return fmt::format(
      "# The camera's noise: variance = read_noise_dn^2 + dn_per_electron * max(DN - "
      "black_level_dn, 0) + 1/12.\n"
      "noise: {{read_noise_dn: {}, dn_per_electron: {}, black_level_dn: {}{}}}\n",
      noise.read_noise_dn, noise.dn_per_electron, noise.black_level_dn, depth);
}

std::string covariance_text(const ModelCovariance& covariance) {
  return fmt::format(
      "# How well all of this is known: the joint covariance of the parameters, in their own "
      "units.\n"
      "covariance:\n"
      "  parameters: [{}]\n"
      "  rows: {}\n"
      "  cols: {}\n"
      "  data: {}\n",
      fmt::join(covariance.parameters, ", "), covariance.matrix.rows(), covariance.matrix.cols(),
      data_text(covariance.matrix, "    "));
}

std::string quality_block(const std::string& quality_yaml) {
  std::string text =
      "# What the calibration measured of itself; nothing is computed from it.\nquality:\n";
  std::istringstream lines(quality_yaml);
  for (std::string line; std::getline(lines, line);) {
    text += line.empty() ? "\n" : "  " + line + "\n";
  }
  return text;
}

}  // namespace

std::string format_model(const StriperModel& model) {
  model.validate();
  std::string text =
      "# A laser line striper: camera and laser planes. SI units; the number is the version of the "
      "format.\n"
      "striper_model: 1\n";
  text += camera_text(model.camera);
  text += lasers_text(model.lasers);
  text +=
      "# One return per image column (axis: columns) or per row (axis: rows); channel: auto, grey, "
      "red,\n# green, blue, green-red or red-green.\n";
  text += detail::stripe_text(model);
  if (model.noise) text += noise_text(*model.noise);
  if (model.covariance) text += covariance_text(*model.covariance);
  if (!model.quality_yaml.empty()) text += quality_block(model.quality_yaml);
  return text;
}

void save_model(const StriperModel& model, const std::filesystem::path& path) {
  write_file_atomically(path, format_model(model));
}

}  // namespace striper
