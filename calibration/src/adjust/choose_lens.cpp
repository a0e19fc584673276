// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <striper/adjust/choose_lens.hpp>
#include <striper/core/error.hpp>

#include "adjust/joint_problem.hpp"

namespace striper {
namespace {

constexpr std::size_t kFolds = 4;
constexpr std::size_t kFewestViews = 6;
constexpr std::size_t kMostViews = 24;
constexpr double kWorthPx = 0.98;  // A richer model must predict better by this factor.
// Reciprocal condition of a lens that the corners determine: what is below is one step from being
// refused, whatever it predicts.
constexpr double kDetermined = 1e-8;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<LensTrial> candidates(std::optional<LensModel> wanted) {
  std::vector<LensTrial> trials;
  for (const LensTrial& trial :
       {LensTrial{LensModel::kPlumbBob, true}, LensTrial{LensModel::kPlumbBob, false},
        LensTrial{LensModel::kEquidistant, false},
        LensTrial{LensModel::kRationalPolynomial, false}})
    if (!wanted || *wanted == trial.lens) trials.push_back(trial);
  return trials;
}

JointOptions options_of(const LensTrial& trial) {
  JointOptions options;
  options.lens = trial.lens;
  options.hold_k3 = trial.hold_k3;
  return options;
}

// Every other corner of a view, like the fields of a checkerboard.
CornerView half_of(const CornerView& view, const Board& board, int parity) {
  CornerView half;
  half.name = view.name;
  for (std::size_t i = 0; i < view.point.size(); ++i) {
    if ((view.point[i] % board.columns + view.point[i] / board.columns) % 2 != parity) continue;
    half.point.push_back(view.point[i]);
    half.pixel.push_back(view.pixel[i]);
  }
  return half;
}

// Squared distances of the half of the corners that did not give the pose, in order to take the
// median: single bad corners must not decide about the lens.
void predict(const CameraModel& camera, const Board& board, const CornerView& view,
             std::vector<double>& squares) {
  detail::JointState state;
  state.set_camera(camera);
  for (const int parity : {0, 1}) {
    const Eigen::Isometry3d T =
        solve_pose(camera, board, half_of(view, board, parity), Eigen::Vector2d::Zero(), nullptr);
    const CornerView rest = half_of(view, board, 1 - parity);
    for (std::size_t i = 0; i < rest.pixel.size(); ++i) {
      const double square =
          detail::corner_residual(state, board, detail::to_block(T), rest.point[i], rest.pixel[i])
              .squaredNorm();
      squares.push_back(std::isfinite(square) ? square : 1e4);
    }
  }
}

// rms of the best 95 %.
double trimmed_rms(std::vector<double> squares) {
  if (squares.empty()) return kNan;
  std::sort(squares.begin(), squares.end());
  const auto kept = static_cast<std::size_t>(0.95 * static_cast<double>(squares.size()));
  double sum = 0.0;
  for (std::size_t i = 0; i < kept; ++i) sum += squares[i];
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(kept, 1)));
}

// @param is_wanted by the user: then it is for the judgement to say that it is not determined.
void score(const Observations& corners, bool is_wanted, LensTrial& trial) {
  try {
    const JointSolution whole = solve_joint(corners, options_of(trial));
    if (whole.rcond < kDetermined && !is_wanted) return;
    trial.rms_px = whole.corners.rms_px;
    std::vector<double> squares;
    for (std::size_t fold = 0; fold < kFolds; ++fold) {
      std::vector<int> training;
      for (std::size_t v = 0; v < corners.views.size(); ++v)
        if (v % kFolds != fold) training.push_back(static_cast<int>(v));
      const JointSolution solution = solve_joint(corners.subset(training), options_of(trial));
      for (std::size_t v = fold; v < corners.views.size(); v += kFolds)
        predict(solution.camera, corners.board, corners.views[v], squares);
    }
    trial.held_out_px = trimmed_rms(std::move(squares));
  } catch (const Error&) {
    // A model that finds no start or runs away is no candidate.
  }
}

// Enough views to tell lenses apart, spread over the session.
Observations some_views(const Observations& observations) {
  std::vector<int> some;
  const std::size_t step = std::max<std::size_t>(1, observations.views.size() / kMostViews);
  for (std::size_t v = 0; v < observations.views.size(); v += step)
    some.push_back(static_cast<int>(v));
  Observations corners = observations.subset(some);
  corners.stripes.clear();
  return corners;
}

}  // namespace

std::string LensTrial::name() const {
  return fmt::format("{}{}", to_string(lens), hold_k3 ? " without k3" : "");
}

LensChoice choose_lens(const Observations& observations, std::optional<LensModel> wanted) {
  const Observations corners = some_views(observations);
  LensChoice choice;
  choice.trials = candidates(wanted);
  choice.lens = choice.trials.front().lens;
  choice.hold_k3 = choice.trials.front().hold_k3;
  if (corners.views.size() < kFewestViews) return choice;
  double best_px = std::numeric_limits<double>::infinity();
  for (LensTrial& trial : choice.trials) {
    score(corners, wanted.has_value(), trial);
    const bool simplest = &trial == &choice.trials.front();
    if (!(trial.held_out_px < (simplest ? 1.0 : kWorthPx) * best_px)) continue;
    best_px = trial.held_out_px;
    choice.lens = trial.lens;
    choice.hold_k3 = trial.hold_k3;
  }
  return choice;
}

}  // namespace striper
