// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <striper/core/frame.hpp>

namespace striper::program {

/// Lets through pictures that show a calibration board sharply and where it was not yet: how
/// pictures for a calibration are gathered from a live camera by moving the board about.
class NewBoardPoses {
 public:
  /// @param board `8x6` (inner corners) or `circles:7x7`.
  /// @throws Error{kUsage} for another form, Error{kUnsupported} where this build has no
  ///         calibration.
  explicit NewBoardPoses(const std::string& board);
  ~NewBoardPoses();

  /// Says on the terminal which pose it is, so that one can move on. Costs 20 ms to 1 s.
  bool lets_through(const Frame& frame);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace striper::program
