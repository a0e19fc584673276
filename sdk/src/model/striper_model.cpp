// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/model/striper_model.hpp>

#include "core/yaml_document.hpp"
#include "model/model_checks.hpp"

namespace striper {

Eigen::Isometry3d StriperModel::T_cam_scan(int laser) const {
  if (laser < 0 || laser >= static_cast<int>(lasers.size())) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("model: there is no laser {} - it has {} of them, "
                            "counted from 0",
                            laser, lasers.size()));
  }
  const Laser& chosen = lasers[static_cast<std::size_t>(laser)];
  return chosen.moved_T_cam_scan ? *chosen.moved_T_cam_scan
                                 : standard_T_cam_scan(chosen.plane, axis);
}

void StriperModel::validate() const {
  if (const auto bad = detail::find_violation(*this)) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("model: {}: {} - expected {}", bad->field, bad->value, bad->expected));
  }
  if (!quality_yaml.empty()) detail::parse_yaml(quality_yaml, "model: quality");
}

}  // namespace striper
