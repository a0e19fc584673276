// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper {

void require_value(bool is_good, std::string_view field, double value, std::string_view expected) {
  if (is_good) return;
  throw Error(ErrorKind::kBadValue, fmt::format("{} is {}; expected {}", field, value, expected));
}

}  // namespace striper
