// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/path_filter.hpp>

#include "guidance/path/wear_estimate.hpp"
#include "track/kalman.hpp"
#include "track/model_weights.hpp"

namespace striper {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kNever = std::numeric_limits<double>::infinity();

constexpr int kPathStates = 4;
constexpr std::size_t kMostBeams = detail::WearEstimate::kMostBeams;
constexpr int kMostStates = kPathStates + static_cast<int>(kMostBeams);
using State = detail::KalmanState<Eigen::Dynamic, kMostStates>;

// How smoothly truck and road run: by how much the vehicle's curvature beside the stripe's, and the
// stripe's own, change over the root of a metre, squared: 1 / m^3. A truck that wanders 3 in over
// 200 ft has 3e-8, over 60 ft 1e-5; one that swerves by a lane in 30 m, 1e-4. A road that goes from
// straight to a bend of 100 m radius within 30 m has 3e-6; to one of 15 m within 8 m, 5e-4.
struct Smoothness {
  double steering;
  double bend;
};
constexpr std::array kModels{
    Smoothness{1e-9, 1e-9}, Smoothness{3e-8, 1e-9}, Smoothness{1e-6, 1e-9},
    Smoothness{1e-5, 1e-9}, Smoothness{3e-8, 1e-6}, Smoothness{1e-6, 1e-6},
    Smoothness{1e-5, 1e-5}, Smoothness{1e-4, 1e-4}, Smoothness{1e-3, 1e-3}};
// What models foretold counts over so much way with sights; between them nothing is forgotten.
constexpr double kMemory_m = 20.0;
constexpr double kLongestStep_m = 0.5;
// Where it begins: a metre off, 6 degrees, bends of 30 m radius. Of what two beams as far before as
// behind the gun see, bends and offsets are told apart by these alone.
constexpr double kStartLateral_m = 1.0;
constexpr double kStartHeading_rad = 0.1;
constexpr double kStartCurvature_1_m = 0.03;
constexpr double kStartSteering_1_m = 0.01;
// Two beams see the same worn edge one after the other, which the filter takes for two: middles are
// worth less by this. Measured: it takes the pulls of the road runs from 1.1 to 1.0.
constexpr double kSharedWear = 1.2;
// A sight further out counts less, by the square of how far; further still, it is of another thing.
constexpr double kFarSigmas = 3.0;
constexpr double kOtherSigmas = 8.0;
// By what models foretell that are at least so probable.
constexpr double kHeard = 0.01;
// After so much way with nothing but other things the path is given up: it is the wrong one.
constexpr double kOther_m = 1.0;
constexpr double kBackwards_m = 0.5;

void require(bool is_good, const char* field, double value, const char* expected) {
  if (is_good) return;
  throw Error(ErrorKind::kBadValue,
              fmt::format("PathFilterOptions::{}={} - expected {}", field, value, expected));
}

double square(double x) noexcept { return x * x; }

}  // namespace

void PathFilterOptions::validate() const {
  if (beam_x_m.empty() || beam_x_m.size() > kMostBeams) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("PathFilterOptions::beam_x_m has {} beams - expected 1 to {}",
                            beam_x_m.size(), kMostBeams));
  }
  for (const double x_m : beam_x_m) require(std::isfinite(x_m), "beam_x_m", x_m, "a number");
  require(gap_limit_m > 0.0, "gap_limit_m", gap_limit_m, "above 0");
  require(wear_m > 0.0 && wear_m < 0.1, "wear_m", wear_m, "above 0, below 0.1");
  require(wear_length_m > 0.0 && wear_length_m < 10.0, "wear_length_m", wear_length_m,
          "above 0, below 10");
}

struct PathFilter::Impl {
  explicit Impl(const PathFilterOptions& how)
      : options(how),
        states(kPathStates + static_cast<int>(how.beam_x_m.size())),
        wear(how.wear_m, how.wear_length_m) {}

  void begin() noexcept;
  void predict(double way_m) noexcept;
  SightVerdict correct(const StripeSight& sight) noexcept;
  State::Vector direction(double x_m) const noexcept;
  void mix(const State::Vector& h, double& mean, double& variance) const noexcept;

  PathFilterOptions options;
  int states;
  detail::WearEstimate wear;
  std::array<State, kModels.size()> models;
  detail::ModelWeights<kModels.size()> likelihood;
  std::array<double, kModels.size()> weights{};
  bool is_known = false;
  double distance_m = kUnknown;
  double seen_at_m = kUnknown;
  double other_since_m = kUnknown;
};

PathFilter::PathFilter(const PathFilterOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(options);
}
PathFilter::PathFilter(PathFilter&&) noexcept = default;
PathFilter& PathFilter::operator=(PathFilter&&) noexcept = default;
PathFilter::~PathFilter() = default;

void PathFilter::Impl::begin() noexcept {
  const double wear_variance = kSharedWear * square(wear.sigma_m());
  for (State& model : models) {
    model.mean = State::Vector::Zero(states);
    model.covariance = State::Matrix::Zero(states, states);
    model.covariance.diagonal().setConstant(wear_variance);
    model.covariance.diagonal().head<kPathStates>() << square(kStartLateral_m),
        square(kStartHeading_rad), square(kStartCurvature_1_m), square(kStartSteering_1_m);
  }
  likelihood = {};
  weights = likelihood.weights();
  is_known = true;
  other_since_m = kUnknown;
}

// y' = heading, heading' = steering = curvature of the stripe less that of the way, both random
// walks; the integral of white noise over the way has the covariance below.
void PathFilter::Impl::predict(double s) noexcept {
  const double alike = std::exp(-s / wear.length_m());
  const double wear_variance = kSharedWear * square(wear.sigma_m()) * (1.0 - alike * alike);
  State::Matrix advance = State::Matrix::Identity(states, states);
  advance(0, 1) = s;
  advance(0, 3) = 0.5 * s * s;
  advance(1, 3) = s;
  Eigen::Matrix3d walk;
  walk << s * s * s * s * s / 20.0, s * s * s * s / 8.0, s * s * s / 6.0,  //
      s * s * s * s / 8.0, s * s * s / 3.0, s * s / 2.0,                   //
      s * s * s / 6.0, s * s / 2.0, s;
  constexpr std::array kWalks{0, 1, 3};
  for (int i = kPathStates; i < states; ++i) advance(i, i) = alike;
  for (std::size_t m = 0; m < models.size(); ++m) {
    State::Matrix noise = State::Matrix::Zero(states, states);
    noise.diagonal().tail(states - kPathStates).setConstant(wear_variance);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        noise(kWalks[static_cast<std::size_t>(i)], kWalks[static_cast<std::size_t>(j)]) =
            kModels[m].steering * walk(i, j);
      }
    }
    noise(2, 2) = kModels[m].bend * s;
    models[m].predict(advance, noise);
  }
}

State::Vector PathFilter::Impl::direction(double x_m) const noexcept {
  State::Vector h = State::Vector::Zero(states);
  h.head<3>() << 1.0, x_m, 0.5 * x_m * x_m;
  return h;
}

SightVerdict PathFilter::Impl::correct(const StripeSight& sight) noexcept {
  State::Vector h = direction(options.beam_x_m[sight.beam] - sight.since_m);
  h[kPathStates + static_cast<int>(sight.beam)] = 1.0;
  // What is narrower or wider than the stripe has its middle off by up to half of that.
  const double odd_m = std::abs(sight.width_m - wear.width_m());
  const double usual_m = 4.0 * wear.sigma_m();
  const double odd_variance = odd_m > usual_m ? square(0.5 * (odd_m - usual_m)) : 0.0;
  const double variance = square(sight.sigma_m) + odd_variance;

  std::array<detail::Innovation, kModels.size()> innovations;
  double nearest = kNever;
  double told = 0.0;
  double likeliest = -1.0;
  for (std::size_t m = 0; m < models.size(); ++m) {
    innovations[m] = models[m].innovation(h, sight.lateral_m, variance);
    if (weights[m] >= kHeard) nearest = std::min(nearest, innovations[m].square());
    if (weights[m] <= likeliest) continue;
    likeliest = weights[m];
    told = innovations[m].value / std::sqrt(innovations[m].variance);
  }
  if (!(nearest <= square(kOtherSigmas))) return {false, told};
  const double way_m = std::isfinite(seen_at_m) ? distance_m - seen_at_m : 0.0;
  likelihood.fade(std::exp(-std::min(way_m, kLongestStep_m) / kMemory_m));
  for (std::size_t m = 0; m < models.size(); ++m) {
    detail::Innovation& innovation = innovations[m];
    likelihood.add(m, innovation.square(), innovation.variance, square(kFarSigmas));
    if (innovation.square() > square(kFarSigmas)) {
      innovation.variance *= innovation.square() / square(kFarSigmas);
    }
    models[m].correct(h, innovation);
  }
  weights = likelihood.weights();
  return {true, told};
}

void PathFilter::Impl::mix(const State::Vector& h, double& mean, double& variance) const noexcept {
  mean = 0.0;
  for (std::size_t m = 0; m < models.size(); ++m) mean += weights[m] * h.dot(models[m].mean);
  variance = 0.0;
  for (std::size_t m = 0; m < models.size(); ++m) {
    variance +=
        weights[m] * (h.dot(models[m].covariance * h) + square(h.dot(models[m].mean) - mean));
  }
}

void PathFilter::advance(double distance_m) noexcept {
  Impl& m = *impl_;
  if (!std::isfinite(distance_m)) return;
  const double way_m = distance_m - m.distance_m;
  if (std::isnan(way_m)) {
    m.distance_m = distance_m;
    return;
  }
  if (way_m < -kBackwards_m) {
    reset();
    m.distance_m = distance_m;
    return;
  }
  if (way_m <= 0.0) return;
  m.distance_m = distance_m;
  if (!m.is_known) return;
  m.predict(way_m);
  if (distance_m - m.seen_at_m > m.options.gap_limit_m) reset();
}

SightVerdict PathFilter::see(const StripeSight& sight) noexcept {
  Impl& m = *impl_;
  const bool is_number = std::isfinite(sight.lateral_m) && std::isfinite(sight.sigma_m);
  if (sight.beam >= m.options.beam_x_m.size() || !is_number || std::isnan(m.distance_m)) return {};
  if (!m.is_known) m.begin();
  SightVerdict verdict = m.correct(sight);
  if (!verdict.is_taken) {
    if (std::isnan(m.other_since_m)) m.other_since_m = m.distance_m;
    if (m.distance_m - std::max(m.other_since_m, m.seen_at_m) < kOther_m) return verdict;
    m.begin();
    verdict = m.correct(sight);
  }
  if (verdict.is_taken) {
    m.seen_at_m = m.distance_m;
    m.other_since_m = kUnknown;
    m.wear.add(sight.beam, sight.width_m, sight.sigma_m,
               m.distance_m + m.options.beam_x_m[sight.beam]);
  }
  return verdict;
}

void PathFilter::see_curvature(double curvature_1_m, double sigma_1_m) noexcept {
  Impl& m = *impl_;
  if (!m.is_known || !std::isfinite(curvature_1_m) || !(sigma_1_m > 0.0)) return;
  State::Vector h = State::Vector::Zero(m.states);
  h[2] = 1.0;
  h[3] = -1.0;
  for (State& model : m.models) {
    model.correct(h, model.innovation(h, curvature_1_m, square(sigma_1_m)));
  }
}

StripePath PathFilter::path() const noexcept {
  const Impl& m = *impl_;
  StripePath path;
  if (!m.is_known) return path;
  double variance = 0.0;
  State::Vector h = State::Vector::Zero(m.states);
  const auto ask = [&](double& mean) {
    m.mix(h, mean, variance);
    h.setZero();
    return std::sqrt(variance);
  };
  h[0] = 1.0;
  path.sigma_lateral_m = ask(path.lateral_m);
  h[1] = 1.0;
  path.sigma_heading_rad = ask(path.heading_rad);
  h[2] = 1.0;
  ask(path.curvature_1_m);
  h[2] = 1.0;
  h[3] = -1.0;
  ask(path.vehicle_curvature_1_m);
  return path;
}

double PathFilter::lateral_at(double x_m) const noexcept {
  if (!impl_->is_known) return kUnknown;
  double mean = 0.0;
  double variance = 0.0;
  impl_->mix(impl_->direction(x_m), mean, variance);
  return mean;
}

double PathFilter::lateral_after(double way_m) const noexcept {
  if (!impl_->is_known) return kUnknown;
  State::Vector h = State::Vector::Zero(impl_->states);
  h[0] = 1.0;
  h[1] = way_m;
  h[3] = 0.5 * way_m * way_m;
  double mean = 0.0;
  double variance = 0.0;
  impl_->mix(h, mean, variance);
  return mean;
}

double PathFilter::sigma_at(double x_m) const noexcept {
  if (!impl_->is_known) return kUnknown;
  double mean = 0.0;
  double variance = 0.0;
  impl_->mix(impl_->direction(x_m), mean, variance);
  return std::sqrt(variance);
}

double PathFilter::unseen_m() const noexcept {
  return impl_->is_known && std::isfinite(impl_->seen_at_m) ? impl_->distance_m - impl_->seen_at_m
                                                            : kNever;
}
double PathFilter::wear_m() const noexcept { return impl_->wear.sigma_m(); }
double PathFilter::wear_length_m() const noexcept { return impl_->wear.length_m(); }

double PathFilter::beam_x_m(std::size_t beam) const noexcept {
  return impl_->options.beam_x_m[beam];
}

void PathFilter::reset() noexcept {
  impl_->is_known = false;
  impl_->other_since_m = kUnknown;
  impl_->seen_at_m = kUnknown;
}

}  // namespace striper
