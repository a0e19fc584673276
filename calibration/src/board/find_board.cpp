// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include <striper/board/find_board.hpp>
#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>

#include "board/corner_model.hpp"
#include "board/dot_image.hpp"

namespace striper {
namespace {

using Corners = std::vector<cv::Point2f>;

// The shortest distance from a grid point to its neighbours in the image.
float nearest_neighbour_px(const Corners& corners, const Board& board, int index) {
  const int column = index % board.columns;
  const int row = index / board.columns;
  float nearest = 1e9F;
  const auto consider = [&](int c, int r) {
    if (c < 0 || r < 0 || c >= board.columns || r >= board.rows) return;
    const auto other = static_cast<std::size_t>(r * board.columns + c);
    const cv::Point2f d = corners[other] - corners[static_cast<std::size_t>(index)];
    nearest = std::min(nearest, std::hypot(d.x, d.y));
  };
  consider(column - 1, row);
  consider(column + 1, row);
  consider(column, row - 1);
  consider(column, row + 1);
  return nearest;
}

double median_square_px(const Corners& corners, const Board& board) {
  std::vector<float> distances;
  distances.reserve(static_cast<std::size_t>(board.point_count()));
  for (int i = 0; i < board.point_count(); ++i)
    distances.push_back(nearest_neighbour_px(corners, board, i));
  return upper_median(distances);
}

// The board's axes in the image at a corner, per square.
struct LocalAxes {
  cv::Point2f along;
  cv::Point2f down;

  // The height of the squares' parallelogram bounds a window, not only its sides.
  float height() const {
    const float area = std::abs(along.x * down.y - along.y * down.x);
    return area / std::max(std::hypot(along.x, along.y), std::hypot(down.x, down.y));
  }
};

LocalAxes local_axes(const Corners& corners, const Board& board, int index) {
  const int c = std::clamp(index % board.columns, 1, board.columns - 2);
  const int r = std::clamp(index / board.columns, 1, board.rows - 2);
  const auto at = [&](int dc, int dr) {
    return corners[static_cast<std::size_t>((r + dr) * board.columns + c + dc)];
  };
  return {0.5F * (at(1, 0) - at(-1, 0)), 0.5F * (at(0, 1) - at(0, -1))};
}

// Refines each corner by a fit of the blurred corner itself, in a circle that stays inside its own
// squares, started from the usual refinement. What does not fit as well as on the rest of the
// board (the stripe or a glare across it) is marked.
void refine_corners(const cv::Mat& grey, const Board& board, Corners& corners, BoardView& view) {
  const cv::TermCriteria stop(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 40, 0.001);
  const Corners start = corners;
  std::vector<double> misfit(corners.size(), 1e9);
  std::vector<double> blurs;
  for (int i = 0; i < board.point_count(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const LocalAxes axes = local_axes(start, board, i);
    const float room = 0.45F * axes.height();
    const int half = std::clamp(static_cast<int>(room), 2, 10);
    Corners one = {start[k]};
    cv::cornerSubPix(grey, one, {half, half}, {-1, -1}, stop);
    const cv::Point2f moved = one[0] - start[k];
    // A corner that walks away has followed another edge; the finder's own answer is better.
    if (std::hypot(moved.x, moved.y) < 0.5F * static_cast<float>(half) + 0.5F) corners[k] = one[0];
    const auto fitted = detail::fit_corner(grey, {corners[k].x, corners[k].y},
                                           {axes.along.x, axes.along.y}, {axes.down.x, axes.down.y},
                                           std::clamp(static_cast<double>(room), 2.8, 9.0));
    if (!fitted) continue;
    corners[k] = {static_cast<float>(fitted->centre_px.x()),
                  static_cast<float>(fitted->centre_px.y())};
    misfit[k] = fitted->residual_dn / std::abs(fitted->amplitude_dn);
    blurs.push_back(fitted->blur_px);
  }
  std::vector<double> sorted = misfit;
  std::sort(sorted.begin(), sorted.end());
  const double usual = sorted[sorted.size() / 2];
  for (const double m : misfit) view.reliable.push_back(m <= std::max(3.0 * usual, 0.05) ? 1 : 0);
  std::sort(blurs.begin(), blurs.end());
  view.blur_px = blurs.empty() ? 0.0 : blurs[blurs.size() / 2];
}

// As OpenCV's sample program has it.
void refine_like_opencv(const cv::Mat& grey, Corners& corners, BoardView& view) {
  cv::cornerSubPix(grey, corners, {11, 11}, {-1, -1},
                   {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 30, 0.0001});
  view.reliable.assign(corners.size(), 1);
}

// Measures each dot; what is not as large as the others are is marked.
void refine_circles(const cv::Mat& grey, const Board& board, Corners& corners, BoardView& view) {
  const Corners start = corners;
  std::vector<double> ratio(corners.size(), 0.0);
  std::vector<double> found;
  for (int i = 0; i < board.point_count(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const LocalAxes axes = local_axes(start, board, i);
    const auto dot = detail::measure_dot(grey, {start[k].x, start[k].y},
                                         {axes.along.x, axes.along.y}, {axes.down.x, axes.down.y});
    if (!dot) continue;
    corners[k] = {static_cast<float>(dot->centre_px.x()), static_cast<float>(dot->centre_px.y())};
    ratio[k] = dot->radius_squares;
    found.push_back(ratio[k]);
  }
  std::sort(found.begin(), found.end());
  view.dot_ratio = found.empty() ? board.dot_ratio : found[found.size() / 2];
  for (const double r : ratio)
    view.reliable.push_back(std::abs(r - view.dot_ratio) <= 0.15 * view.dot_ratio ? 1 : 0);
}

// The brightness that all but the brightest pixels stay below.
double bright_level(const cv::Mat& grey) {
  cv::Mat histogram;
  const int channel = 0;
  const int bins = 256;
  const float range[] = {0.0F, 256.0F};
  const float* ranges = range;
  cv::calcHist(&grey, 1, &channel, {}, histogram, 1, &bins, &ranges);
  double above = 0.0;
  int level = 255;
  for (; level > 0; --level) {
    above += histogram.at<float>(level);
    if (above > 0.005 * static_cast<double>(grey.total())) break;
  }
  return level;
}

// Squares of a dozen pixels or fewer in a dim image are found twice as large and bright.
bool find_enlarged(const cv::Mat& grey, cv::Size size, int flags, Corners& corners) {
  constexpr double kLargest = 1.3e6;
  if (static_cast<double>(grey.total()) > kLargest) return false;
  cv::Mat bright;
  grey.convertTo(bright, CV_8U, std::min(8.0, 250.0 / std::max(bright_level(grey), 8.0)));
  cv::Mat large;
  cv::resize(bright, large, {}, 2.0, 2.0, cv::INTER_CUBIC);
  if (!cv::findChessboardCornersSB(large, size, corners, flags)) return false;
  // Pixel (0, 0) is a centre in both.
  for (cv::Point2f& corner : corners) corner = 0.5F * (corner - cv::Point2f(0.5F, 0.5F));
  return true;
}

bool find_classic(const cv::Mat& grey, cv::Size size, Corners& corners) {
  return cv::findChessboardCorners(
      grey, size, corners,
      cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK);
}

bool find_checkerboard(const cv::Mat& grey, const Board& board, BoardSearch search,
                       Corners& corners, bool& classic) {
  const cv::Size size(board.columns, board.rows);
  const int sb_flags =
      cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY;
  classic = false;
  const bool is_thorough = search == BoardSearch::kThorough;
  if (is_thorough && cv::findChessboardCornersSB(grey, size, corners, sb_flags)) return true;
  classic = find_classic(grey, size, corners);
  if (search == BoardSearch::kLikeOpenCv) return classic;
  return classic || (is_thorough && find_enlarged(grey, size, sb_flags, corners));
}

bool find_circles(const cv::Mat& grey, const Board& board, Corners& corners) {
  cv::SimpleBlobDetector::Params params;
  params.minArea = 12.0F;
  params.maxArea = static_cast<float>(grey.total()) / 16.0F;
  params.minDistBetweenBlobs = 4.0F;
  const auto detector = cv::SimpleBlobDetector::create(params);
  const cv::Size size(board.columns, board.rows);
  return cv::findCirclesGrid(grey, size, corners, cv::CALIB_CB_SYMMETRIC_GRID, detector) ||
         cv::findCirclesGrid(grey, size, corners,
                             cv::CALIB_CB_SYMMETRIC_GRID | cv::CALIB_CB_CLUSTERING, detector);
}

float cross(cv::Point2f a, cv::Point2f b) { return a.x * b.y - a.y * b.x; }

float mean_around(const cv::Mat& grey, cv::Point2f centre, int half) {
  const cv::Rect window(cvRound(centre.x) - half, cvRound(centre.y) - half, 2 * half + 1,
                        2 * half + 1);
  const cv::Rect inside = window & cv::Rect(0, 0, grey.cols, grey.rows);
  return inside.empty() ? 127.0F : static_cast<float>(cv::mean(grey(inside))[0]);
}

// True where the square inside of the first corner (between the first two rows and columns) is
// darker than its neighbour: the colours tell the two ends of the board apart.
bool first_inner_square_is_dark(const cv::Mat& grey, const Board& board, const Corners& c) {
  const auto n = static_cast<std::size_t>(board.columns);
  const cv::Point2f first = 0.25F * (c[0] + c[1] + c[n] + c[n + 1]);
  const cv::Point2f second = 0.25F * (c[1] + c[2] + c[n + 1] + c[n + 2]);
  return mean_around(grey, first, 1) < mean_around(grey, second, 1);
}

void mirror_rows(const Board& board, Corners& corners) {
  for (int row = 0; row < board.rows; ++row)
    std::reverse(corners.begin() + row * board.columns,
                 corners.begin() + (row + 1) * board.columns);
}

// Makes the order right-handed and the first corner the same one in every image.
void make_order_consistent(const cv::Mat& grey, const Board& board, Corners& corners) {
  const auto n = static_cast<std::size_t>(board.columns);
  if (cross(corners[n - 1] - corners[0], corners[corners.size() - n] - corners[0]) < 0.0F)
    mirror_rows(board, corners);
  const bool ends_differ =
      board.pattern == Board::Pattern::kCheckerboard && (board.columns + board.rows) % 2 == 1;
  const bool turn =
      ends_differ ? !first_inner_square_is_dark(grey, board, corners)
                  : corners.back().x + corners.back().y < corners.front().x + corners.front().y;
  if (turn) std::reverse(corners.begin(), corners.end());
}

std::string why_not_found(const cv::Mat& grey, const Board& board) {
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(grey, mean, deviation);
  if (bright_level(grey) < 30.0) return fmt::format("too dark (mean {:.0f} of 255)", mean[0]);
  if (mean[0] > 245.0) return fmt::format("over-exposed (mean {:.0f} of 255)", mean[0]);
  if (deviation[0] < 5.0)
    return fmt::format("no contrast (standard deviation {:.1f})", deviation[0]);
  return fmt::format(
      "no complete {} board: part of it outside the image or covered, blurred, or too oblique",
      to_string(board));
}

}  // namespace

cv::Mat to_grey8(const cv::Mat& image) {
  if (image.empty() || (image.depth() != CV_8U && image.depth() != CV_16U) ||
      (image.channels() != 1 && image.channels() != 3))
    throw Error(ErrorKind::kBadValue,
                fmt::format("image is {}x{} with {} channels of type {}; expected an image of 8 "
                            "or 16 bit, grey or colour",
                            image.cols, image.rows, image.channels(), image.depth()));
  cv::Mat grey;
  if (image.channels() == 3)
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  else
    grey = image;
  if (grey.depth() == CV_8U) return grey;
  double brightest = 0.0;
  cv::minMaxLoc(grey, nullptr, &brightest);
  cv::Mat grey8;
  grey.convertTo(grey8, CV_8U, 255.0 / std::max(brightest, 255.0));
  return grey8;
}

BoardView find_board(const cv::Mat& image, const Board& board, BoardSearch search) {
  board.validate();
  const cv::Mat grey = to_grey8(image);
  BoardView view;
  Corners corners;
  const bool checkerboard = board.pattern == Board::Pattern::kCheckerboard;
  view.found = checkerboard
                   ? find_checkerboard(grey, board, search, corners, view.by_classic_finder)
                   : find_circles(grey, board, corners);
  if (!view.found) {
    view.reason = why_not_found(grey, board);
    return view;
  }
  make_order_consistent(grey, board, corners);
  if (checkerboard && search == BoardSearch::kLikeOpenCv)
    refine_like_opencv(grey, corners, view);
  else if (checkerboard)
    refine_corners(grey, board, corners, view);
  else
    refine_circles(grey, board, corners, view);
  view.square_px = median_square_px(corners, board);
  for (const cv::Point2f& corner : corners) view.corners_px.emplace_back(corner.x, corner.y);
  return view;
}

std::string guess_board_size(const cv::Mat& image, const Board& board) {
  if (board.pattern != Board::Pattern::kCheckerboard) return {};
  const cv::Mat grey = to_grey8(image);
  static constexpr std::array<std::array<int, 2>, 8> kSteps = {
      {{-1, -1}, {1, 1}, {-1, 0}, {0, -1}, {1, 0}, {0, 1}, {-2, -2}, {-1, 1}}};
  for (const auto& step : kSteps) {
    Board other = board;
    other.columns += step[0];
    other.rows += step[1];
    if (other.columns < 3 || other.rows < 3) continue;
    Corners corners;
    // A smaller board is found inside of a larger one too, so it proves nothing unless it is whole:
    // CALIB_CB_LARGER makes the finder grow it as far as it goes.
    cv::Mat meta;
    const bool found = cv::findChessboardCornersSB(
        grey, {other.columns, other.rows}, corners,
        cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_LARGER, meta);
    if (!found || meta.empty()) continue;
    // The finder's rows may be the board's columns: counted the way that is nearer to the given
    // one.
    const auto off = [&board](int columns, int rows) {
      return std::abs(columns - board.columns) + std::abs(rows - board.rows);
    };
    const bool is_turned = off(meta.rows, meta.cols) < off(meta.cols, meta.rows);
    return is_turned ? fmt::format("{}x{}", meta.rows, meta.cols)
                     : fmt::format("{}x{}", meta.cols, meta.rows);
  }
  return {};
}

}  // namespace striper
