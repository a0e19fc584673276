// SPDX-License-Identifier: Apache-2.0
#include "board/corner_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Dense>

namespace striper::detail {
namespace {

// cx, cy, edge angles, blur, A, B, slope x, slope y.
using Parameters = Eigen::Matrix<double, 9, 1>;
using Normal = Eigen::Matrix<double, 9, 9>;

struct Sample {
  double x, y, value;
};

std::vector<Sample> samples_around(const cv::Mat& grey, const Eigen::Vector2d& centre,
                                   double radius) {
  std::vector<Sample> samples;
  const int left = std::max(0, static_cast<int>(std::ceil(centre.x() - radius)));
  const int right = std::min(grey.cols - 1, static_cast<int>(std::floor(centre.x() + radius)));
  const int top = std::max(0, static_cast<int>(std::ceil(centre.y() - radius)));
  const int bottom = std::min(grey.rows - 1, static_cast<int>(std::floor(centre.y() + radius)));
  for (int row = top; row <= bottom; ++row)
    for (int column = left; column <= right; ++column)
      if (std::hypot(column - centre.x(), row - centre.y()) <= radius)
        samples.push_back({static_cast<double>(column), static_cast<double>(row),
                           static_cast<double>(grey.at<std::uint8_t>(row, column))});
  return samples;
}

// Value and derivatives of the model at one pixel.
double model(const Parameters& p, double x, double y, Parameters& gradient) {
  const double dx = x - p[0];
  const double dy = y - p[1];
  const double c1 = std::cos(p[2]);
  const double s1 = std::sin(p[2]);
  const double c2 = std::cos(p[3]);
  const double s2 = std::sin(p[3]);
  const double d1 = c1 * dx + s1 * dy;
  const double d2 = c2 * dx + s2 * dy;
  const double scale = 1.0 / (std::numbers::sqrt2 * p[4]);
  const double e1 = std::erf(d1 * scale);
  const double e2 = std::erf(d2 * scale);
  const double slope = 2.0 * scale * std::numbers::inv_sqrtpi;
  const double g1 = slope * std::exp(-d1 * d1 * scale * scale);
  const double g2 = slope * std::exp(-d2 * d2 * scale * scale);
  const double a = p[5];
  gradient << -a * (g1 * c1 * e2 + e1 * g2 * c2) - p[7], -a * (g1 * s1 * e2 + e1 * g2 * s2) - p[8],
      a * g1 * e2 * (c1 * dy - s1 * dx), a * g2 * e1 * (c2 * dy - s2 * dx),
      -a * (d1 * g1 * e2 + d2 * g2 * e1) / p[4], e1 * e2, 1.0, dx, dy;
  return p[6] + p[7] * dx + p[8] * dy + a * e1 * e2;
}

double linearise(const std::vector<Sample>& samples, const Parameters& p, Normal& A,
                 Parameters& b) {
  A.setZero();
  b.setZero();
  double sum = 0.0;
  Parameters gradient;
  for (const Sample& s : samples) {
    const double r = s.value - model(p, s.x, s.y, gradient);
    sum += r * r;
    A.selfadjointView<Eigen::Lower>().rankUpdate(gradient);
    b += r * gradient;
  }
  A = Normal(A.selfadjointView<Eigen::Lower>());
  return sum;
}

Parameters start(const std::vector<Sample>& samples, const Eigen::Vector2d& centre,
                 const Eigen::Vector2d& along, const Eigen::Vector2d& down) {
  Parameters p;
  p << centre.x(), centre.y(), std::atan2(along.x(), -along.y()), std::atan2(down.x(), -down.y()),
      1.0, 0.0, 0.0, 0.0, 0.0;
  // The signed mean over the quadrants gives the amplitude and which of them are dark.
  double mean = 0.0;
  double signed_mean = 0.0;
  const Eigen::Vector2d n1(std::cos(p[2]), std::sin(p[2]));
  const Eigen::Vector2d n2(std::cos(p[3]), std::sin(p[3]));
  for (const Sample& s : samples) {
    const Eigen::Vector2d d(s.x - centre.x(), s.y - centre.y());
    mean += s.value;
    signed_mean += n1.dot(d) * n2.dot(d) > 0.0 ? s.value : -s.value;
  }
  p[5] = signed_mean / static_cast<double>(samples.size());
  p[6] = mean / static_cast<double>(samples.size());
  return p;
}

}  // namespace

std::optional<CornerModel> fit_corner(const cv::Mat& grey, const Eigen::Vector2d& start_px,
                                      const Eigen::Vector2d& along, const Eigen::Vector2d& down,
                                      double radius_px) {
  const std::vector<Sample> samples = samples_around(grey, start_px, radius_px);
  if (samples.size() < 20) return std::nullopt;
  Parameters p = start(samples, start_px, along, down);
  Normal A;
  Parameters b;
  double sum = linearise(samples, p, A, b);
  double damping = 1e-3;
  for (int iteration = 0; iteration < 30; ++iteration) {
    Normal damped = A;
    damped.diagonal() += damping * A.diagonal() + Parameters::Constant(1e-9);
    const Parameters step = damped.ldlt().solve(b);
    Parameters next = p + step;
    next[4] = std::clamp(next[4], 0.25, radius_px);
    Normal next_A;
    Parameters next_b;
    const double next_sum = linearise(samples, next, next_A, next_b);
    if (!(next_sum < sum)) {
      if (step.head<2>().norm() < 1e-4 || damping > 1e4) break;
      damping *= 8.0;
      continue;
    }
    p = next;
    A = next_A;
    b = next_b;
    sum = next_sum;
    damping *= 0.2;
    if (step.head<2>().norm() < 1e-4) break;
  }
  const Eigen::Vector2d centre = p.head<2>();
  const bool plausible = p.allFinite() && (centre - start_px).norm() < 0.5 * radius_px &&
                         p[4] < 0.6 * radius_px && std::abs(p[5]) > 2.0;
  if (!plausible) return std::nullopt;
  return CornerModel{centre, p[2], p[3],
                     p[5],   p[4], std::sqrt(sum / static_cast<double>(samples.size()))};
}

}  // namespace striper::detail
