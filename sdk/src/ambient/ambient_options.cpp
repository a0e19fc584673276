// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <striper/ambient/ambient_options.hpp>
#include <striper/core/error.hpp>

namespace striper {

std::string_view to_string(AmbientMethod method) noexcept {
  switch (method) {
    case AmbientMethod::kAuto:
      return "auto";
    case AmbientMethod::kNone:
      return "none";
    case AmbientMethod::kAlternate:
      return "alternate";
    case AmbientMethod::kFields:
      return "fields";
    case AmbientMethod::kTemporal:
      return "temporal";
  }
  return "";
}

void AmbientOptions::validate() const {
  const bool needs_dark = method == AmbientMethod::kAlternate || method == AmbientMethod::kFields;
  if (needs_dark && !pattern.is_automatic() && !pattern.has_dark()) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("ambient method {} needs dark exposures and the pattern '{}' has none: "
                            "give for example laser=0,dark, or use ambient none",
                            to_string(method), pattern.to_string()));
  }
}

}  // namespace striper
