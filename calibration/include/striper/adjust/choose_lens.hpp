// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <striper/adjust/solve_joint.hpp>
#include <striper/board/observations.hpp>

namespace striper {

/// One lens model that was tried.
struct LensTrial {
  LensModel lens = LensModel::kPlumbBob;
  bool hold_k3 = false;
  /// Of the views that it was fitted to, and of views that it was not fitted to, which decides.
  /// NaN: there are too few views to try it, they do not determine it, or it found no start.
  double rms_px = std::numeric_limits<double>::quiet_NaN();
  double held_out_px = std::numeric_limits<double>::quiet_NaN();
  std::string name() const;
};

/// What cross-validation chose, and from what.
struct LensChoice {
  LensModel lens = LensModel::kPlumbBob;
  bool hold_k3 = false;
  std::vector<LensTrial> trials;
};

/// Chooses the lens model by four-fold cross-validation over the views: a model is fitted to three
/// quarters of them; in each view of the last quarter half of the corners give the pose and the
/// other half is predicted. More coefficients always lower the residual; only what predicts better
/// by 2 % or more is worth them.
///
/// With fewer than six views the simplest model is taken: there is nothing to hold out.
/// @param wanted only models of this lens; empty: all. An adjustment for each lens that is tried.
LensChoice choose_lens(const Observations& observations, std::optional<LensModel> wanted);

}  // namespace striper
