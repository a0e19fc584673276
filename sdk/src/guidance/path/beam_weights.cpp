// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/beam_weights.hpp>

namespace striper {

std::vector<double> beam_weights(std::span<const double> beam_x_m, double at_x_m) {
  if (beam_x_m.empty()) throw Error(ErrorKind::kBadValue, "no beams; expected one or more");
  std::vector<double> weights(beam_x_m.size(), 1.0);
  for (std::size_t i = 0; i < beam_x_m.size(); ++i) {
    for (std::size_t j = 0; j < beam_x_m.size(); ++j) {
      if (i == j) continue;
      weights[i] *= (at_x_m - beam_x_m[j]) / (beam_x_m[i] - beam_x_m[j]);
    }
    if (!std::isfinite(weights[i]) || !std::isfinite(beam_x_m[i])) {
      throw Error(ErrorKind::kBadValue,
                  fmt::format("x_m of beam {} is {}; expected finite, and of no other beam", i,
                              beam_x_m[i]));
    }
  }
  return weights;
}

}  // namespace striper
