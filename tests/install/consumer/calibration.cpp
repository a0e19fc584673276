// SPDX-License-Identifier: Apache-2.0
// Links the installed calibration library and what it stands on.
#include <cstdio>

#include <striper/board/board.hpp>
#include <striper/session/calibrate.hpp>

int main() {
  const striper::Board board = striper::parse_board("8x6", 0.04);
  std::printf("a board of %d corners\n", board.point_count());
  return board.point_count() == 48 && !striper::board_svg(board).empty() ? 0 : 1;
}
