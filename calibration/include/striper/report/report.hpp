// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <striper/session/calibrate.hpp>

namespace striper {

/// Writes what a person needs to judge a calibration as one HTML file that needs nothing else:
/// the verdict in words first, what to do better, the figures with their error bars, the predicted
/// range error over the field, coverage, residuals, cross-validation, and every image with what
/// was found in it.
/// @throws Error{kIo} naming the file.
void save_report(const Calibration& calibration, const std::filesystem::path& path);

/// The text that `save_report` writes. Reads the images again.
std::string format_report(const Calibration& calibration);

}  // namespace striper
