// SPDX-License-Identifier: Apache-2.0
#include "stripe/edges/edge_profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "core/pixel_box.hpp"

namespace striper::detail {
namespace {

constexpr double kMostContrast = 0.98;
constexpr double kLeastBlur = 0.15;      // Pixels: no lens is sharper.
constexpr double kMostOfWidth = 0.95;    // The blur is a part of the stripe's width.
constexpr double kLeastAmplitude = 0.5;  // DN.
// Background farther than so many widths off counts as Cauchy's distribution of this scale has it.
constexpr double kCore = 2.5;
constexpr double kScale2 = 9.0;
constexpr double kSettled = 1e-3;  // Of the cost.
constexpr double kFirstDamping = 1e-2;
constexpr double kMostDamping = 1e4;
constexpr double kFitted = 6.0;        // Parameters that the pixels, not the priors, determine.
constexpr double kFittedToCore = 3.0;  // Of them to those that the stripe is on.
constexpr double kLeastFreedom = 3.0;

constexpr auto kParameters = static_cast<int>(EdgeModel::kCount);
using Vector = Eigen::Matrix<double, kParameters, 1>;
using Matrix = Eigen::Matrix<double, kParameters, kParameters>;

struct Step {
  double part;     // Integral of a normal distribution,
  double density;  // and its density.
};

constexpr double kGone = 5.5;  // Sigmas: a normal distribution has 4e-8 beyond.

// To 1.5e-7 (Abramowitz & Stegun 1964, equation 7.1.26).
Step step_at(double z) {
  if (std::abs(z) > kGone) return {z > 0.0 ? 1.0 : 0.0, 0.0};
  const double x = std::abs(z) * 0.70710678118654752;
  const double t = 1.0 / (1.0 + 0.3275911 * x);
  const double e = std::exp(-x * x);
  const double series =
      t *
      (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
  const double tail = 0.5 * series * e;
  return {z > 0.0 ? 1.0 - tail : tail, 0.39894228040143268 * e};
}

// One model, ready to be evaluated at pixels. The laser's profile L has the variance w^2 - b^2, b
// the blur; a step of reflectance at e makes of it the blurred product, by completing the square
// b * (L H(x - e)) = G_w(x - p) Phi((m - e) / t), m = (p b^2 + x (w^2 - b^2)) / w^2 and t^2 =
// (w^2 - b^2) b^2 / w^2. The pixel's box is part of the blur.
class Light {
 public:
  Light(const EdgeModel& model, EdgeKind kind, double middle)
      : p_(model.of), middle_(middle), laser_contrast_(kind == EdgeKind::kReflectance ? 2.0 : 0.0) {
    const double blur = p_[EdgeModel::kBlur];
    const double width = p_[EdgeModel::kWidth];
    blur2_ = blur * blur + kPixelBox2;
    width2_ = width * width + kPixelBox2;
    laser2_ = std::max(width2_ - blur2_, 0.05 * width2_);
    per_blur_ = 1.0 / std::sqrt(blur2_);
    per_mixed_ = std::sqrt(width2_ / (laser2_ * blur2_));
  }

  struct Value {
    double background = 0.0;
    double laser = 0.0;
    Vector of_background;  // Derivatives.
    Vector of_laser;
  };

  Value at(double x) const {
    Value v;
    v.of_background.setZero();
    v.of_laser.setZero();
    add_background(x, v);
    add_laser(x, v);
    return v;
  }

 private:
  void add_background(double x, Value& v) const {
    const double contrast = p_[EdgeModel::kContrast];
    const double ambient = p_[EdgeModel::kAmbient];
    const double z = (x - p_[EdgeModel::kEdge]) * per_blur_;
    const Step wide = step_at(z);
    const double side = 2.0 * wide.part - 1.0;
    const double edge = 2.0 * contrast * ambient * wide.density;
    v.background = p_[EdgeModel::kBlack] + ambient * (1.0 + contrast * side) +
                   p_[EdgeModel::kSlope] * (x - middle_);
    v.of_background[EdgeModel::kContrast] = ambient * side;
    v.of_background[EdgeModel::kEdge] = -edge * per_blur_;
    v.of_background[EdgeModel::kAmbient] = 1.0 + contrast * side;
    v.of_background[EdgeModel::kBlack] = 1.0;
    v.of_background[EdgeModel::kSlope] = x - middle_;
    v.of_background[EdgeModel::kBlur] = -edge * z * p_[EdgeModel::kBlur] / blur2_;
  }

  void add_laser(double x, Value& v) const {
    const double off = x - p_[EdgeModel::kPosition];
    if (off * off > kGone * kGone * width2_) return;
    const double contrast = p_[EdgeModel::kContrast];
    const double g = std::exp(-0.5 * off * off / width2_);
    const double share = blur2_ / width2_;
    const double y = (x - off * share - p_[EdgeModel::kEdge]) * per_mixed_;
    const Step lit = step_at(y);
    const double lit_side = laser_contrast_ * (lit.part - 0.5);
    const double light = p_[EdgeModel::kAmplitude] * g;
    const double lit_edge = laser_contrast_ * contrast * light * lit.density;
    v.laser = light * (1.0 + contrast * lit_side);
    v.of_laser[EdgeModel::kPosition] = v.laser * off / width2_ + lit_edge * share * per_mixed_;
    v.of_laser[EdgeModel::kAmplitude] = g * (1.0 + contrast * lit_side);
    v.of_laser[EdgeModel::kContrast] = light * lit_side;
    v.of_laser[EdgeModel::kEdge] = -lit_edge * per_mixed_;
    // Of m, and of t = sqrt(laser2 blur2 / width2).
    const double blur = p_[EdgeModel::kBlur];
    const double by_blur = -2.0 * off * per_mixed_ / width2_ - y * (1.0 / blur2_ - 1.0 / laser2_);
    v.of_laser[EdgeModel::kBlur] = lit_edge * blur * by_blur;
    const double width = p_[EdgeModel::kWidth];
    const double by_width =
        2.0 * off * share * per_mixed_ / width2_ - y * (1.0 / laser2_ - 1.0 / width2_);
    v.of_laser[EdgeModel::kWidth] =
        width * (v.laser * off * off / (width2_ * width2_) + lit_edge * by_width);
  }

  const std::array<double, EdgeModel::kCount>& p_;
  double middle_;
  double laser_contrast_;
  double blur2_, width2_, laser2_, per_blur_, per_mixed_;
};

// The normal equations at one model.
struct Normal {
  Matrix information = Matrix::Zero();  // Its lower triangle.
  Vector gradient = Vector::Zero();
  double cost = 0.0;
  double chi2 = 0.0;
  double freedom = -kFitted;
  double core_chi2 = 0.0;  // Of the pixels that the stripe is on.
  int core_rows = 0;
};

// Makes the normal equations of one pixel after the other: a column of derivatives for each
// parameter, whose products are then summed over all pixels at once.
class NormalSum {
 public:
  void add(double residual, double variance, bool is_core, const Vector& derivative) {
    const double r2 = residual * residual / variance;
    if (is_core) {
      core_chi2_ += r2;
      ++core_rows_;
    } else {
      add_far(1.0 + r2 / kScale2);
    }
    const double weight = is_core ? 1.0 : kScale2 / (kScale2 + r2);
    const double root = std::sqrt(weight / variance);
    derivatives_.row(rows_) = root * derivative;
    residuals_[rows_++] = root * residual;
  }

  Normal total() const {
    Normal normal;
    const auto column = [this](int i) { return derivatives_.col(i).head(rows_); };
    for (int i = 0; i < kParameters; ++i) {
      for (int j = 0; j <= i; ++j) normal.information(i, j) = column(i).dot(column(j));
      normal.gradient[i] = column(i).dot(residuals_.head(rows_));
    }
    normal.cost = normal.chi2 = core_chi2_ + kScale2 * (far_logs_ + std::log(far_product_));
    normal.freedom += rows_;
    normal.core_chi2 = core_chi2_;
    normal.core_rows = core_rows_;
    return normal;
  }

 private:
  // One logarithm of a product takes the time of one of a factor.
  void add_far(double factor) {
    constexpr double kLarge = 1e100;
    far_product_ *= factor;
    if (far_product_ < kLarge) return;
    far_logs_ += std::log(far_product_);
    far_product_ = 1.0;
  }

  static constexpr int kMostRows = 2 * static_cast<int>(EdgeProfile::kMost);
  Eigen::Matrix<double, kMostRows, kParameters> derivatives_;
  Eigen::Matrix<double, kMostRows, 1> residuals_;
  int rows_ = 0;
  double core_chi2_ = 0.0;
  int core_rows_ = 0;
  double far_product_ = 1.0;
  double far_logs_ = 0.0;
};

void add_prior(const EdgePrior& prior, const EdgeModel& model, Normal& normal) {
  for (std::size_t i = 0; i < EdgeModel::kCount; ++i) {
    if (!(prior.sigma[i] > 0.0)) continue;
    const double per_variance = 1.0 / (prior.sigma[i] * prior.sigma[i]);
    const double off = prior.mean.of[i] - model.of[i];
    const auto n = static_cast<int>(i);
    normal.cost += off * off * per_variance;
    normal.gradient[n] += off * per_variance;
    normal.information(n, n) += per_variance;
  }
}

Normal normal_at(const EdgeProfile& profile, const PlanNoise& noise, const EdgePrior& prior,
                 const EdgeModel& model, EdgeKind kind) {
  const double middle = profile.count > 0 ? profile.at[profile.count / 2] : 0.0;
  const Light light(model, kind, middle);
  const double core = kCore * std::hypot(model.of[EdgeModel::kWidth], std::sqrt(kPixelBox2));
  const double speckle2 = noise.speckle_contrast * noise.speckle_contrast;
  NormalSum sum;
  for (std::size_t i = 0; i < profile.count; ++i) {
    const Light::Value v = light.at(profile.at[i]);
    const bool is_core = std::abs(profile.at[i] - model.of[EdgeModel::kPosition]) < core;
    const double value = v.background + v.laser;
    const double variance =
        noise.model.variance_dn2(value) + speckle2 * v.laser * v.laser + profile.extra[i];
    const bool is_above = profile.clipped[i] && value >= profile.lit[i];
    if (!is_above) sum.add(profile.lit[i] - value, variance, is_core, v.of_background + v.of_laser);
    if (!profile.has_dark) continue;
    const double gain = std::max(0.05, noise.dark_noise_gain);
    sum.add(profile.dark[i] - v.background, gain * noise.model.variance_dn2(v.background), is_core,
            v.of_background);
  }
  Normal normal = sum.total();
  add_prior(prior, model, normal);
  return normal;
}

// NaN where the matrix is not positive definite. Its two halves by themselves, since clang-tidy
// takes what `solve` allocates for a leak.
Vector solved(const Matrix& information, Vector right) {
  const Eigen::LLT<Matrix> factors(information);
  if (factors.info() != Eigen::Success) return Vector::Constant(std::nan(""));
  factors.matrixL().solveInPlace(right);
  factors.matrixU().solveInPlace(right);
  return right;
}

EdgeModel moved(const EdgeModel& model, const Vector& step) {
  EdgeModel m = model;
  for (std::size_t i = 0; i < EdgeModel::kCount; ++i) m.of[i] += step[static_cast<int>(i)];
  double& contrast = m.of[EdgeModel::kContrast];
  contrast = std::clamp(contrast, -kMostContrast, kMostContrast);
  m.of[EdgeModel::kAmplitude] = std::max(kLeastAmplitude, m.of[EdgeModel::kAmplitude]);
  m.of[EdgeModel::kAmbient] = std::max(0.0, m.of[EdgeModel::kAmbient]);
  const double before = model.of[EdgeModel::kWidth];
  double& width = m.of[EdgeModel::kWidth];
  width = std::clamp(width, 0.7 * before, 1.4 * before);
  double& blur = m.of[EdgeModel::kBlur];
  blur = std::clamp(blur, std::min(kLeastBlur, 0.5 * width), kMostOfWidth * width);
  return m;
}

}  // namespace

EdgeEstimate fit_edge(const EdgeProfile& profile, const PlanNoise& noise, const EdgePrior& prior,
                      const EdgeModel& start, EdgeKind kind, int most_steps) {
  EdgeEstimate best;
  best.model = moved(start, Vector::Zero());
  Normal normal = normal_at(profile, noise, prior, best.model, kind);
  double damping = kFirstDamping;
  for (int step = 0; step < most_steps && damping < kMostDamping; ++step) {
    Matrix damped = normal.information;
    damped.diagonal() *= 1.0 + damping;
    const EdgeModel next = moved(best.model, solved(damped, normal.gradient));
    const Normal there = normal_at(profile, noise, prior, next, kind);
    if (!(there.cost < normal.cost)) {
      damping *= 10.0;
      continue;
    }
    const bool is_settled = normal.cost - there.cost < kSettled * (1.0 + there.cost);
    best.model = next;
    normal = there;
    damping *= 0.1;
    if (is_settled) break;
  }
  best.cost = normal.cost;
  best.misfit = normal.chi2 / std::max(kLeastFreedom, normal.freedom);
  best.core_misfit = normal.core_chi2 / std::max(kLeastFreedom, normal.core_rows - kFittedToCore);
  const Vector unit = Vector::Unit(static_cast<int>(EdgeModel::kPosition));
  const double variance = solved(normal.information, unit)[0];
  best.variance = std::isfinite(variance) ? variance : -1.0;
  return best;
}

EdgeEstimate fit_edge_from(std::span<const EdgeModel> starts, const EdgeProfile& profile,
                           const PlanNoise& noise, const EdgePrior& prior, int first_steps,
                           int most_steps) {
  if (starts.empty()) return {};
  EdgeEstimate best;
  best.cost = std::numeric_limits<double>::infinity();
  for (const EdgeModel& start : starts) {
    const EdgeEstimate found =
        fit_edge(profile, noise, prior, start, EdgeKind::kReflectance, first_steps);
    if (found.cost < best.cost) best = found;
  }
  return fit_edge(profile, noise, prior, best.model, EdgeKind::kReflectance, most_steps);
}

}  // namespace striper::detail
