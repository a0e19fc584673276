// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

#include <striper/core/robust.hpp>
#include <striper/geometry/triangulator.hpp>

#include "session/calibration_steps.hpp"

namespace striper::detail {
namespace {

// A course over range is a broken line of so many knots, at equal ratios of range: a width or an
// amplitude that goes as a power of the range is met within 2 % over a factor of 4.
constexpr int kKnots = 5;
// Over less of a depth there is no course to see.
constexpr double kLeastDepth = 1.05;
constexpr std::size_t kFewestReturns = 40;
// Of an image with more clipped returns the others are the faint ones, and tell too little.
constexpr double kMostClipped = 0.2;
// Light that grazes the board says more of its surface than of the laser.
constexpr double kLeastCosine = 0.3;

struct Sample {
  double range_m;
  double value;
};

struct Samples {
  std::vector<Sample> width_px;
  std::vector<Sample> amplitude_dn;
  std::array<std::vector<double>, 3> colour;
  std::size_t clipped = 0;
  std::size_t returns = 0;
};

const BoardStripe& stripe_of(const ImageResult& result) {
  return result.single_frame ? *result.single_frame : result.stripe;
}

bool is_used(const ImageResult& result, int laser) {
  return result.laser == laser && result.stripe_view >= 0 && stripe_of(result).found();
}

bool is_often_clipped(const BoardStripe& stripe) {
  const auto clipped = std::count_if(stripe.samples.begin(), stripe.samples.end(),
                                     [](const StripeSample& s) { return s.is_clipped; });
  return static_cast<double>(clipped) > kMostClipped * static_cast<double>(stripe.samples.size());
}

// The light is taken to come from the scan frame's origin, the laser plane's point nearest to the
// camera: where in its plane the laser is, no image tells.
double cosine_of_incidence(const Eigen::Vector3d& point_cam, const Eigen::Vector3d& origin_cam,
                           const Eigen::Isometry3d& T_cam_board) {
  return std::abs(T_cam_board.linear().col(2).dot((point_cam - origin_cam).normalized()));
}

void collect(const Calibration& calibration, const ImageResult& result,
             const Triangulator& triangulator, Samples& samples) {
  const BoardStripe& stripe = stripe_of(result);
  const bool is_dim_part = is_often_clipped(stripe);
  const Eigen::Isometry3d& T_cam_board =
      calibration.solution.T_cam_board[static_cast<std::size_t>(result.view)];
  for (const StripeSample& sample : stripe.samples) {
    const PlanePoint at = triangulator.triangulate(sample.pixel);
    if (at.status != ReturnStatus::kOk) continue;
    ++samples.returns;
    if (sample.is_clipped) ++samples.clipped;
    // Where the converter ended below the peak, the image's width is that of the flanks.
    samples.width_px.push_back(
        {at.range_m(), sample.is_clipped ? stripe.width_px : sample.width_px});
    if (sample.is_clipped || !sample.is_white || is_dim_part) continue;
    const Eigen::Isometry3d& T = triangulator.T_cam_scan();
    const double cosine =
        cosine_of_incidence(T * Eigen::Vector3d(at.x_m, at.y_m, 0.0), T.translation(), T_cam_board);
    if (cosine < kLeastCosine || !(sample.amplitude_dn > 0.0F)) continue;
    samples.amplitude_dn.push_back({at.range_m(), sample.amplitude_dn / cosine});
  }
  for (std::size_t c = 0; c < 3 && stripe.colour; ++c)
    samples.colour[c].push_back((*stripe.colour)[c]);
}

Samples samples_of(const Calibration& calibration, int laser) {
  Samples samples;
  const Triangulator triangulator(calibration.model, laser);
  for (const ImageResult& result : calibration.images)
    if (is_used(result, laser)) collect(calibration, result, triangulator, samples);
  return samples;
}

double median_value(const std::vector<Sample>& samples) {
  std::vector<double> values;
  values.reserve(samples.size());
  for (const Sample& sample : samples) values.push_back(sample.value);
  return upper_median(values);
}

// So that a person can read what is written: the nearest number of so many parts of 1.
double rounded(double value, double parts) { return std::round(value * parts) / parts; }

// A broken line through the logarithms of values over range: least squares with weights that tame
// what is far off (Huber 1964), its bends held small where a knot has few samples.
class Course {
 public:
  explicit Course(const std::vector<Sample>& samples) {
    const auto [near, far] =
        std::minmax_element(samples.begin(), samples.end(),
                            [](const Sample& a, const Sample& b) { return a.range_m < b.range_m; });
    for (int k = 0; k < kKnots; ++k)
      range_m_[k] = near->range_m * std::pow(far->range_m / near->range_m, k / (kKnots - 1.0));
    log_value_.setConstant(std::log(median_value(samples)));
    for (int round = 0; round < 6; ++round) fit(samples);
  }

  double range_m(int knot) const { return range_m_[knot]; }
  double value(int knot) const { return std::exp(log_value_[knot]); }

 private:
  using Knots = Eigen::Matrix<double, kKnots, 1>;

  Knots shares_at(double range_m) const {
    Knots shares = Knots::Zero();
    int k = 0;
    while (k + 2 < kKnots && range_m > range_m_[k + 1]) ++k;
    const double part =
        std::clamp((range_m - range_m_[k]) / (range_m_[k + 1] - range_m_[k]), 0.0, 1.0);
    shares[k] = 1.0 - part;
    shares[k + 1] = part;
    return shares;
  }

  void fit(const std::vector<Sample>& samples) {
    std::vector<double> residuals;
    residuals.reserve(samples.size());
    for (const Sample& sample : samples)
      residuals.push_back(
          std::abs(std::log(sample.value) - shares_at(sample.range_m).dot(log_value_)));
    std::vector<double> sorted = residuals;
    const double sigma = std::max(sigma_of_absolute(sorted), 1e-4);
    Eigen::Matrix<double, kKnots, kKnots> N = Eigen::Matrix<double, kKnots, kKnots>::Zero();
    Knots y = Knots::Zero();
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Knots shares = shares_at(samples[i].range_m);
      const double weight = 1.0 / std::max(1.0, residuals[i] / (1.5 * sigma));
      N += weight * shares * shares.transpose();
      y += weight * std::log(samples[i].value) * shares;
    }
    // A hundredth of the samples' own weight: felt only where there are next to none.
    const double stiffness = 0.01 * static_cast<double>(samples.size());
    for (int k = 0; k + 2 < kKnots; ++k) {
      Knots bend = Knots::Zero();
      bend[k] = bend[k + 2] = 1.0;
      bend[k + 1] = -2.0;
      N += stiffness * bend * bend.transpose();
    }
    log_value_ = N.ldlt().solve(y);
  }

  static double sigma_of_absolute(std::vector<double>& absolute) {
    return kSigmaOfMedianAbsolute * upper_median(absolute);
  }

  Knots range_m_;
  Knots log_value_;
};

std::optional<Course> course_of(const std::vector<Sample>& samples) {
  if (samples.size() < kFewestReturns) return std::nullopt;
  const auto [near, far] =
      std::minmax_element(samples.begin(), samples.end(),
                          [](const Sample& a, const Sample& b) { return a.range_m < b.range_m; });
  if (far->range_m < kLeastDepth * near->range_m) return std::nullopt;
  return Course(samples);
}

}  // namespace

StripeLook measure_look(const Calibration& calibration, int laser) {
  Samples samples = samples_of(calibration, laser);
  StripeLook look;
  if (samples.width_px.empty()) return look;
  look.width_px = rounded(median_value(samples.width_px), 1e4);
  if (const auto width = course_of(samples.width_px))
    for (int k = 0; k < kKnots; ++k)
      look.width_at.push_back({rounded(width->range_m(k), 1e4), rounded(width->value(k), 1e4)});
  if (const auto amplitude = course_of(samples.amplitude_dn))
    for (int k = 0; k < kKnots; ++k)
      look.amplitude_at.push_back(
          {rounded(amplitude->range_m(k), 1e4), rounded(amplitude->value(k), 1e2)});
  if (samples.colour[0].empty()) return look;
  std::array<double, 3> colour{};
  double total = 0.0;
  for (std::size_t c = 0; c < 3; ++c) total += colour[c] = upper_median(samples.colour[c]);
  for (double& share : colour) share = rounded(share / total, 1e4);
  look.colour = colour;
  return look;
}

double clipped_share(const Calibration& calibration, int laser) {
  const Samples samples = samples_of(calibration, laser);
  if (samples.returns == 0) return 0.0;
  return static_cast<double>(samples.clipped) / static_cast<double>(samples.returns);
}

}  // namespace striper::detail
