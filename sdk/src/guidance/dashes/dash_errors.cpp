// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/dash_errors.hpp>

namespace striper {

DashErrors dash_errors(std::span<const double> measured_m, std::span<const double> found_m,
                       const DashErrorOptions& options) {
  if (measured_m.size() != found_m.size()) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("{} ends were measured and {} found; expected one of each",
                            measured_m.size(), found_m.size()));
  }
  DashErrors errors;
  double before_m = 0.0;  // The error of the end before.
  for (std::size_t i = 0; i < measured_m.size(); ++i) {
    const bool is_begin = (i % 2 == 0) == options.first_is_begin;
    const double extended_m = found_m[i] + (is_begin ? -1.0 : 1.0) * options.end_extension_m;
    const double error_m = measured_m[i] - extended_m;
    if (i > 0) {
      ++errors.ends;
      ++errors.lengths;
      if (std::abs(error_m) <= options.end_within_m) ++errors.ends_within;
      if (std::abs(error_m - before_m) <= options.length_within_m) ++errors.lengths_within;
    }
    before_m = error_m;
  }
  return errors;
}

}  // namespace striper
