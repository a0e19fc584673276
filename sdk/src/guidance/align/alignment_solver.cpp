// SPDX-License-Identifier: Apache-2.0
#include "guidance/align/alignment_solver.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace striper::detail {
namespace {

constexpr double kPriorZero_m = 0.1;
constexpr double kPriorScale = 0.1;
// Residuals of a few places may be small by chance.
constexpr double kLeastFactor = 0.3;
constexpr int kSteps = 12;
constexpr double kSmallStep = 1e-12;

using Rows = Eigen::MatrixXd;

// The state is gain p and shift q of each beam: seen = p * lateral + q, which noise does not bend.
struct State {
  Eigen::VectorXd gain;
  Eigen::VectorXd shift_m;
};

// One place, whitened: residuals, derivatives by the place's own two and by all beams' gain, shift.
struct PlaceRows {
  Eigen::VectorXd residual;
  Rows own;
  Rows beams;
};

PlaceRows rows_of(const LinePlace& place, const std::vector<double>& x_m, const State& state,
                  const Eigen::Vector2d& line, double factor) {
  const auto sights = static_cast<Eigen::Index>(place.sights.size());
  const auto rows = sights + static_cast<Eigen::Index>(place.tapes.size());
  PlaceRows out{Eigen::VectorXd(rows), Rows(rows, 2),
                Rows::Zero(rows, 2 * static_cast<Eigen::Index>(x_m.size()))};
  for (Eigen::Index i = 0; i < sights; ++i) {
    const LinePlace::Sight& sight = place.sights[static_cast<std::size_t>(i)];
    const auto beam = static_cast<Eigen::Index>(sight.beam);
    const double weight = 1.0 / (factor * sight.sigma_m);
    const double lateral_m = line[0] + line[1] * x_m[sight.beam];
    out.residual[i] = weight * (sight.seen_m - state.gain[beam] * lateral_m - state.shift_m[beam]);
    out.own.row(i) << weight * state.gain[beam], weight * state.gain[beam] * x_m[sight.beam];
    out.beams(i, 2 * beam) = weight * lateral_m;
    out.beams(i, 2 * beam + 1) = weight;
  }
  for (Eigen::Index i = sights; i < rows; ++i) {
    const LinePlace::Tape& tape = place.tapes[static_cast<std::size_t>(i - sights)];
    const double weight = 1.0 / tape.sigma_m;
    out.residual[i] = weight * (tape.lateral_m - line[0] - line[1] * tape.x_m);
    out.own.row(i) << weight, weight * tape.x_m;
  }
  return out;
}

// The place's own line, given the beams.
Eigen::Vector2d line_of(const LinePlace& place, const std::vector<double>& x_m, const State& state,
                        double factor) {
  const PlaceRows rows = rows_of(place, x_m, state, Eigen::Vector2d::Zero(), factor);
  return (rows.own.transpose() * rows.own).ldlt().solve(rows.own.transpose() * rows.residual);
}

bool is_determined(const LinePlace& place, const std::vector<double>& x_m) {
  std::vector<double> at_m;
  for (const auto& sight : place.sights) at_m.push_back(x_m[sight.beam]);
  for (const auto& tape : place.tapes) at_m.push_back(tape.x_m);
  const auto [least, most] = std::minmax_element(at_m.begin(), at_m.end());
  return at_m.size() >= 3 && *most - *least > 0.1;
}

struct Normal {
  Eigen::MatrixXd squares;
  Eigen::VectorXd products;
};

Normal prior_of(const State& state) {
  const Eigen::Index size = 2 * state.gain.size();
  Normal normal{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  for (Eigen::Index i = 0; i < state.gain.size(); ++i) {
    normal.squares(2 * i, 2 * i) = 1.0 / (kPriorScale * kPriorScale);
    normal.squares(2 * i + 1, 2 * i + 1) = 1.0 / (kPriorZero_m * kPriorZero_m);
    normal.products[2 * i] = (1.0 - state.gain[i]) * normal.squares(2 * i, 2 * i);
    normal.products[2 * i + 1] = -state.shift_m[i] * normal.squares(2 * i + 1, 2 * i + 1);
  }
  return normal;
}

Normal normal_of(const std::vector<LinePlace>& places, const std::vector<double>& x_m,
                 const State& state, double factor) {
  Normal normal = prior_of(state);
  for (const LinePlace& place : places) {
    if (!is_determined(place, x_m)) continue;
    const Eigen::Vector2d line = line_of(place, x_m, state, factor);
    const PlaceRows rows = rows_of(place, x_m, state, line, factor);
    const Eigen::MatrixXd own = (rows.own.transpose() * rows.own).inverse();
    const Rows beams = rows.beams - rows.own * (own * (rows.own.transpose() * rows.beams));
    normal.squares += beams.transpose() * rows.beams;
    normal.products += beams.transpose() * rows.residual;
  }
  return normal;
}

void solve(const std::vector<LinePlace>& places, const std::vector<double>& x_m, double factor,
           State& state, Eigen::MatrixXd& covariance) {
  for (int step = 0; step < kSteps; ++step) {
    const Normal normal = normal_of(places, x_m, state, factor);
    const auto cholesky = normal.squares.ldlt();
    const Eigen::VectorXd change = cholesky.solve(normal.products);
    for (Eigen::Index i = 0; i < state.gain.size(); ++i) {
      state.gain[i] = std::clamp(state.gain[i] + change[2 * i], 0.2, 5.0);
      state.shift_m[i] += change[2 * i + 1];
    }
    covariance =
        cholesky.solve(Eigen::MatrixXd::Identity(normal.squares.rows(), normal.squares.cols()));
    if (change.norm() < kSmallStep) return;
  }
}

// How well places are met: sum of squares over their freedom, and in metres.
struct Misfit {
  double squares = 0.0;
  double squares_m2 = 0.0;
  double freedom = 0.0;
  double sights = 0.0;
};

template <typename Takes>
Misfit misfit_of(const std::vector<LinePlace>& places, const std::vector<double>& x_m,
                 const State& state, double factor, Takes takes) {
  Misfit misfit;
  for (const LinePlace& place : places) {
    if (!is_determined(place, x_m) || !takes(place)) continue;
    const Eigen::Vector2d line = line_of(place, x_m, state, factor);
    const PlaceRows rows = rows_of(place, x_m, state, line, factor);
    misfit.squares += rows.residual.squaredNorm();
    misfit.freedom += static_cast<double>(rows.residual.size() - 2);
    for (std::size_t i = 0; i < place.sights.size(); ++i) {
      const double off_m =
          rows.residual[static_cast<Eigen::Index>(i)] * factor * place.sights[i].sigma_m;
      misfit.squares_m2 += off_m * off_m;
      misfit.sights += 1.0;
    }
  }
  return misfit;
}

}  // namespace

AlignmentFit fit_alignment(const std::vector<double>& beam_x_m,
                           const std::vector<LinePlace>& places) {
  const auto beams = static_cast<Eigen::Index>(beam_x_m.size());
  State state{Eigen::VectorXd::Ones(beams), Eigen::VectorXd::Zero(beams)};
  Eigen::MatrixXd covariance;
  const auto has_no_tape = [](const LinePlace& place) { return place.tapes.empty(); };
  const auto has_tape = [](const LinePlace& place) { return !place.tapes.empty(); };
  AlignmentFit fit;
  solve(places, beam_x_m, 1.0, state, covariance);
  const Misfit along = misfit_of(places, beam_x_m, state, 1.0, has_no_tape);
  if (along.freedom > 0.0) fit.line_factor = std::sqrt(along.squares / along.freedom);
  if (along.sights > 0.0) fit.line_rms_m = std::sqrt(along.squares_m2 / along.sights);
  // Sights are worth what they show to be: one between two sweeps is better than either, one of a
  // worn line worse.
  const double factor = std::max(kLeastFactor, fit.line_factor);
  solve(places, beam_x_m, factor, state, covariance);
  const Misfit taped = misfit_of(places, beam_x_m, state, factor, has_tape);
  if (taped.freedom > 0.0) fit.tape_rms = std::sqrt(taped.squares / taped.freedom);

  // From gain and shift to zero = -shift / gain and scale = 1 / gain.
  fit.zeros_scales.resize(2 * beams);
  Eigen::MatrixXd turn = Eigen::MatrixXd::Zero(2 * beams, 2 * beams);
  for (Eigen::Index i = 0; i < beams; ++i) {
    const double gain = state.gain[i];
    fit.zeros_scales[2 * i] = -state.shift_m[i] / gain;
    fit.zeros_scales[2 * i + 1] = 1.0 / gain;
    turn(2 * i, 2 * i) = state.shift_m[i] / (gain * gain);
    turn(2 * i, 2 * i + 1) = -1.0 / gain;
    turn(2 * i + 1, 2 * i) = -1.0 / (gain * gain);
  }
  fit.covariance = turn * covariance * turn.transpose();
  return fit;
}

}  // namespace striper::detail
