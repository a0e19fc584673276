// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {

/// What `Scene::validate` throws: says the field by its path in a scene file, and in that file's
/// unit, so that the reader of one finds its line.
class SceneViolation : public Error {
 public:
  SceneViolation(std::string field, const std::string& complaint)
      : Error(ErrorKind::kBadValue, fmt::format("{}: {}", field, complaint)),
        field_(std::move(field)) {}

  /// As in `lasers[0].fan_deg`.
  const std::string& field() const noexcept { return field_; }

 private:
  std::string field_;
};

}  // namespace striper::detail
