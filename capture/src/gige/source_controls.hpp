// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <striper/core/controls.hpp>

#include "gige/session.hpp"

namespace striper::detail {

/// What was set by hand: a camera that was lost gets it again when it is back.
struct KeptSettings {
  std::optional<double> exposure_us;
  std::optional<double> gain_db;
  bool lasers_on = true;
};

/// Where the controls of a source find its camera, and put what is to be kept.
struct ControlledCamera {
  std::function<std::shared_ptr<Session>()> session;  ///< @throws Error{kDevice} where it is lost.
  std::function<void(const std::function<void(KeptSettings&)>&)> keep;
};

/// `exposure_us`, `gain_db`, `laser` where a line of the camera fires one, `region` (read only).
Controls make_controls(const std::string& source, const ControlledCamera& camera);

}  // namespace striper::detail
