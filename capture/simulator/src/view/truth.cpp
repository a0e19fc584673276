// SPDX-License-Identifier: Apache-2.0
#include <striper/simulator/truth.hpp>

namespace striper {

std::string_view to_string(TruthStatus status) noexcept {
  switch (status) {
    case TruthStatus::kVisible:
      return "visible";
    case TruthStatus::kNoSurface:
      return "no_surface";
    case TruthStatus::kShadowed:
      return "shadowed";
    case TruthStatus::kOutsideFan:
      return "outside_fan";
    case TruthStatus::kOutsideModel:
      return "outside_model";
  }
  return "";
}

}  // namespace striper
