// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <striper/core/frame.hpp>

namespace striper::program {

/// Lets through frames that show a calibration board sharply and where it was not yet: how
/// images for a calibration are gathered from a live camera by moving the board about.
class NewBoardPoses {
 public:
  /// @param board `8x6` (inner corners) or `circles:7x7`.
  /// @param is_live there is always another frame: most of those without a board are let go after
  ///        a quick look, so that the ones with it are seen as they come.
  /// @throws Error{kUsage} for another form, Error{kUnsupported} where this build has no
  ///         calibration.
  NewBoardPoses(const std::string& board, bool is_live);
  ~NewBoardPoses();

  /// Says on the terminal which pose it is, so that one can move on. Costs as `find_board` does.
  bool lets_through(const Frame& frame);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace striper::program
