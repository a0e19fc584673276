// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <striper/joint/observations.hpp>
#include <striper/joint/solve_joint.hpp>

namespace striper {

/// One lens model that was tried.
struct LensTrial {
  LensModel lens = LensModel::kPlumbBob;
  bool hold_k3 = false;
  double rms_px = 0.0;       ///< Of the views that it was fitted to.
  double held_out_px = 0.0;  ///< Of views that it was not fitted to: what decides. NaN: it failed.
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
/// @param wanted only models of this lens; empty: all. Cost ~1 s for 20 views.
LensChoice choose_lens(const Observations& observations, std::optional<LensModel> wanted);

}  // namespace striper
