// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/path_filter.hpp>

#include "guidance/path/path_model.hpp"
#include "guidance/path/wear_estimate.hpp"
#include "guidance/path/wear_places.hpp"
#include "track/model_weights.hpp"

namespace striper {
namespace {

using detail::PathModel;
using detail::Smoothness;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kNever = std::numeric_limits<double>::infinity();

// A truck that wanders 3 in over 200 ft has a steering of 3e-8, over 60 ft 1e-5; one that swerves
// by a lane in 30 m, 1e-4. A road that goes from straight to a bend of 100 m radius within 30 m has
// a twist of 4e-9; to one of 15 m within 8 m, 8e-6. Twists ten times more or less double the errors
// in bends (RoadRunBends) and change none on straights. Where the middle beam is dead, bends and
// offsets are told apart by what curvature a model begins with alone: straight roads' 200 m radius
// lets the path be known after 25 m, bends' 30 m is there for who begins on one.
constexpr double kStraight_1_m = 0.005;
constexpr double kBent_1_m = 0.03;
constexpr std::array kModels{
    Smoothness{1e-9, 1e-9, 0.0, kStraight_1_m}, Smoothness{3e-8, 1e-9, 0.0, kStraight_1_m},
    Smoothness{1e-6, 1e-9, 0.0, kStraight_1_m}, Smoothness{1e-5, 1e-9, 0.0, kStraight_1_m},
    Smoothness{3e-8, 1e-7, 1e-9, kBent_1_m},    Smoothness{1e-6, 1e-7, 1e-6, kBent_1_m},
    Smoothness{1e-5, 1e-6, 1e-6, kBent_1_m},    Smoothness{1e-4, 1e-5, 1e-5, kBent_1_m},
    Smoothness{1e-3, 1e-4, 1e-5, kBent_1_m}};
// What models predicted counts over so much way with sights; between them nothing is forgotten.
constexpr double kMemory_m = 20.0;
constexpr double kLongestStep_m = 0.5;
// Edges that are broken off in pieces are more alike from one look to the next than the exponential
// that fits them: by so much its length is too short. Measured: innovations of the road runs are
// white to .045 with it, to .065 without (PathFilter.FollowsASolidLineOnStraightsAndBends).
constexpr double kRounder = 1.12;
// A sight further out counts less, by the square of how far; further still, it is of another thing.
constexpr double kFarSigmas = 3.0;
constexpr double kOtherSigmas = 8.0;
// By what models foretell that are at least so probable.
constexpr double kHeard = 0.01;
// After so much way with nothing but other things the path is given up: it is the wrong one.
constexpr double kOther_m = 1.0;
constexpr double kBackwards_m = 0.5;
// Functions of the path by its states.
const PathModel::PathVector kLateral{1.0, 0.0, 0.0, 0.0, 0.0};
const PathModel::PathVector kHeading{0.0, 1.0, 0.0, 0.0, 0.0};
const PathModel::PathVector kCurvature{0.0, 0.0, 1.0, 0.0, 0.0};
const PathModel::PathVector kVehicleCurvature{0.0, 0.0, 1.0, -1.0, 0.0};

double square(double x) noexcept { return x * x; }

}  // namespace

void PathFilterOptions::validate() const {
  if (beam_x_m.empty() || beam_x_m.size() > detail::WearPlaces::kMostBeams) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("PathFilterOptions::beam_x_m has {} beams - expected 1 to {}",
                            beam_x_m.size(), detail::WearPlaces::kMostBeams));
  }
  for (const double x_m : beam_x_m)
    require_value(std::isfinite(x_m), "PathFilterOptions::beam_x_m", x_m, "a number");
  require_value(gap_limit_m > 0.0, "PathFilterOptions::gap_limit_m", gap_limit_m, "above 0");
  require_value(wear_m > 0.0 && wear_m < 0.1, "PathFilterOptions::wear_m", wear_m,
                "above 0, below 0.1");
  require_value(wear_length_m > 0.0 && wear_length_m < 10.0, "PathFilterOptions::wear_length_m",
                wear_length_m, "above 0, below 10");
}

struct PathFilter::Impl {
  explicit Impl(const PathFilterOptions& how)
      : options(how), places(how.beam_x_m), wear(how.wear_m, how.wear_length_m) {}

  void begin() noexcept;
  void move_wear(int beam, double place_m) noexcept;
  SightVerdict correct(const StripeSight& sight) noexcept;
  double variance_of(const StripeSight& sight) const noexcept;
  void take(std::array<PathModel::Look, kModels.size()>& looks) noexcept;
  double mean(const PathModel::PathVector& weights_of_states) const noexcept;
  double sigma(const PathModel::PathVector& weights_of_states) const noexcept;

  PathFilterOptions options;
  detail::WearPlaces places;
  detail::WearEstimate wear;
  std::array<PathModel, kModels.size()> models;
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
  for (std::size_t m = 0; m < models.size(); ++m) {
    models[m].begin(places.states(), square(wear.sigma_m()), kModels[m]);
  }
  likelihood = {};
  weights = likelihood.weights();
  places.clear();
  is_known = true;
  other_since_m = kUnknown;
}

// The wear that a beam sees is now that of another place.
void PathFilter::Impl::move_wear(int beam, double place_m) noexcept {
  const auto bridge = places.bridge(beam, place_m, kRounder * wear.length_m());
  for (PathModel& model : models) model.move_wear(beam, bridge, square(wear.sigma_m()));
  const auto copy = places.arrive(beam, place_m);
  if (!copy) return;
  for (PathModel& model : models) model.copy_wear(beam, *copy);
}

// What is narrower or wider than the stripe has its middle off by up to half of that.
double PathFilter::Impl::variance_of(const StripeSight& sight) const noexcept {
  const double odd_m = std::abs(sight.width_m - wear.width_m());
  const double usual_m = 4.0 * wear.sigma_m();
  const double odd_variance = odd_m > usual_m ? square(0.5 * (odd_m - usual_m)) : 0.0;
  return square(sight.sigma_m) + odd_variance;
}

SightVerdict PathFilter::Impl::correct(const StripeSight& sight) noexcept {
  const double x_m = options.beam_x_m[sight.beam] - sight.since_m;
  const auto beam = static_cast<int>(sight.beam);
  move_wear(beam, distance_m + x_m);
  const double variance = variance_of(sight);
  std::array<PathModel::Look, kModels.size()> looks;
  double nearest = kNever;
  for (std::size_t m = 0; m < models.size(); ++m) {
    looks[m] = models[m].look(x_m, beam, sight.lateral_m, variance);
    if (weights[m] >= kHeard) nearest = std::min(nearest, looks[m].innovation.square());
  }
  const auto likeliest =
      static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) - weights.begin());
  const detail::Innovation& told = looks[likeliest].innovation;
  const SightVerdict verdict{nearest <= square(kOtherSigmas),
                             told.value / std::sqrt(told.variance)};
  if (verdict.is_taken) take(looks);
  return verdict;
}

void PathFilter::Impl::take(std::array<PathModel::Look, kModels.size()>& looks) noexcept {
  const double way_m = std::isfinite(seen_at_m) ? distance_m - seen_at_m : 0.0;
  likelihood.fade(std::exp(-std::min(way_m, kLongestStep_m) / kMemory_m));
  for (std::size_t m = 0; m < models.size(); ++m) {
    detail::Innovation& innovation = looks[m].innovation;
    likelihood.add(m, innovation.square(), innovation.variance, square(kFarSigmas));
    if (innovation.square() > square(kFarSigmas)) {
      innovation.variance *= innovation.square() / square(kFarSigmas);
    }
    models[m].take(looks[m]);
  }
  weights = likelihood.weights();
}

double PathFilter::Impl::mean(const PathModel::PathVector& of) const noexcept {
  double mean = 0.0;
  for (std::size_t m = 0; m < models.size(); ++m) mean += weights[m] * models[m].mean(of);
  return mean;
}

double PathFilter::Impl::sigma(const PathModel::PathVector& of) const noexcept {
  const double middle = mean(of);
  double variance = 0.0;
  for (std::size_t m = 0; m < models.size(); ++m) {
    variance += weights[m] * (models[m].variance(of) + square(models[m].mean(of) - middle));
  }
  return std::sqrt(variance);
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
  for (std::size_t i = 0; i < kModels.size(); ++i) m.models[i].advance(way_m, kModels[i]);
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
  for (PathModel& model : m.models) {
    model.take(model.look(kVehicleCurvature, curvature_1_m, square(sigma_1_m)));
  }
}

StripePath PathFilter::path() const noexcept {
  const Impl& m = *impl_;
  StripePath path;
  if (!m.is_known) return path;
  path.lateral_m = m.mean(kLateral);
  path.sigma_lateral_m = m.sigma(kLateral);
  path.heading_rad = m.mean(kHeading);
  path.sigma_heading_rad = m.sigma(kHeading);
  path.curvature_1_m = m.mean(kCurvature);
  path.vehicle_curvature_1_m = m.mean(kVehicleCurvature);
  return path;
}

double PathFilter::lateral_at(double x_m) const noexcept {
  return impl_->is_known ? impl_->mean(PathModel::lateral_at(x_m)) : kUnknown;
}

double PathFilter::lateral_after(double way_m) const noexcept {
  return impl_->is_known ? impl_->mean(PathModel::lateral_after(way_m)) : kUnknown;
}

double PathFilter::sigma_at(double x_m) const noexcept {
  return impl_->is_known ? impl_->sigma(PathModel::lateral_at(x_m)) : kUnknown;
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
