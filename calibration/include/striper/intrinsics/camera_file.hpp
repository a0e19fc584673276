// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <striper/intrinsics/known_camera.hpp>
#include <striper/model/camera_model.hpp>

namespace striper {

/// Reads a camera from a file of any of these kinds, told apart by their content:
/// - a model file of this project (its lasers are ignored; its covariance comes along),
/// - a ROS camera_info YAML (image_width, camera_matrix, distortion_model, ...), pixels square or
/// not,
/// - an OpenCV FileStorage file, YAML or XML (camera_matrix or cameraMatrix or M1 or K;
///   distortion_coefficients or dist_coeffs or D1 or D; image_width/image_height or image_size).
/// @throws Error{kNotFound, kBadFile} naming the file, the field and what was expected.
KnownCamera load_camera(const std::filesystem::path& path);

/// Writes a plain ROS camera_info YAML, as camera_calibration_parsers read it.
/// @throws Error{kIo}.
void save_camera_info(const CameraModel& camera, const std::string& camera_name,
                      const std::filesystem::path& path);

/// The text that `save_camera_info` writes.
std::string format_camera_info(const CameraModel& camera, const std::string& camera_name);

}  // namespace striper
