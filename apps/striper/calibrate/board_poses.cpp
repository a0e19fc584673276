// SPDX-License-Identifier: Apache-2.0
#include "calibrate/board_poses.hpp"

#include <striper/core/error.hpp>

#ifdef STRIPER_HAS_CALIBRATION

#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <fmt/format.h>

#include <striper/board/find_board.hpp>

#include "program/terminal.hpp"

namespace striper::program {
namespace {

constexpr double kSharp_px = 2.0;         // Blur beyond which corners are not worth keeping.
constexpr double kNewPose_squares = 0.5;  // Root mean square motion of the corners.
constexpr int kThoroughEvery = 10;        // Of live frames in which a quick look finds no board.

double rms_motion_px(const BoardView& a, const BoardView& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.corners_px.size(); ++i) {
    sum += (a.corners_px[i] - b.corners_px[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(a.corners_px.size()));
}

}  // namespace

struct NewBoardPoses::State {
  Board board;
  bool is_live = false;
  int in_vain = 0;  // Quick looks in a row.
  std::vector<BoardView> kept;

  BoardView look(const cv::Mat& image) {
    // There is one way only of looking for circles.
    const bool has_quick_look = board.pattern == Board::Pattern::kCheckerboard;
    if (!is_live || !has_quick_look) return find_board(image, board);
    BoardView view = find_board(image, board, BoardSearch::kQuick);
    in_vain = view.found ? 0 : in_vain + 1;
    return in_vain > 0 && in_vain % kThoroughEvery == 0 ? find_board(image, board) : view;
  }

  bool is_new(const BoardView& view) const {
    for (const BoardView& other : kept) {
      if (rms_motion_px(view, other) < kNewPose_squares * view.square_px) return false;
    }
    return true;
  }
};

NewBoardPoses::NewBoardPoses(const std::string& board, bool is_live)
    : state_(std::make_unique<State>()) {
  constexpr double kAnySquare_m = 1.0;  // Only pixels matter here.
  state_->board = parse_board(board, kAnySquare_m);
  state_->is_live = is_live;
}

bool NewBoardPoses::lets_through(const Frame& frame) {
  if (frame.status != FrameStatus::kOk) return false;
  BoardView view = state_->look(frame.image);
  if (!view.found || view.blur_px > kSharp_px || !state_->is_new(view)) return false;
  state_->kept.push_back(std::move(view));
  say(fmt::format("frame {}: pose {} kept, squares of {:.0f} px", frame.sequence,
                  state_->kept.size(), state_->kept.back().square_px));
  return true;
}

#else

namespace striper::program {

struct NewBoardPoses::State {};

NewBoardPoses::NewBoardPoses(const std::string& /*board*/, bool /*is_live*/) {
  throw Error(ErrorKind::kUnsupported,
              "--when-board: this program was built without the calibration module");
}

bool NewBoardPoses::lets_through(const Frame& /*frame*/) { return false; }

#endif

NewBoardPoses::~NewBoardPoses() = default;

}  // namespace striper::program
