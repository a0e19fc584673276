// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <striper/geometry/line_fit.hpp>

namespace striper {

LineFit LineSums::solve() const noexcept {
  LineFit fit;
  fit.points = points;
  if (!is_determined()) return fit;
  fit.is_determined = true;
  fit.covariance << gg, -fg, -fg, ff;
  fit.covariance /= determinant();
  fit.parameters = fit.covariance * Eigen::Vector2d(fz, gz);
  fit.chi2 = std::max(zz - fit.parameters[0] * fz - fit.parameters[1] * gz, 0.0);
  return fit;
}

}  // namespace striper
