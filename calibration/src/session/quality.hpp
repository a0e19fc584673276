// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <striper/session/calibrate.hpp>

namespace striper::detail {

/// The `quality:` block of a model file: what the calibration measured about itself.
std::string quality_yaml(const Calibration& calibration, const std::string& date);

}  // namespace striper::detail
