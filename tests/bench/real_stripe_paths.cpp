// SPDX-License-Identifier: Apache-2.0
// Finds the laser's stripe in a set of real colour images by its colour and by the whole image
// at once, and writes the paths down (tests/support/real_stripe_paths.txt) for stripe_choice_table.
// It shares nothing with the extractor: no profile fit, no grey value, no model; a Viterbi path
// through the closed and smoothed colour difference, and only where it stands out is it kept.
//
//     real_stripe_paths rows|columns red|green|bright-red LIMIT FOLDER_OF_THE_SET IMAGE... > part
//     of the table (LIMIT: pieces that begin farther across are left out; the environment's
//     STRIPER_OVERLAYS names a folder: the paths are drawn into images there)
//
// Every path of the table was looked at in such drawings before it was taken.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace {

// In the image turned so that the stripe crosses every column.
constexpr int kCore = 17;               // The widest clipped core, pixels.
constexpr int kHalfCore = 11;           // How far from its path a stripe goes on across.
constexpr int kAlong = 9;               // The signal is averaged over so many scan lines,
constexpr double kAcross = 2.0;         // and over a Gaussian of this sigma across.
constexpr double kJump = 6.0;           // What it costs to go elsewhere, in units of the threshold.
constexpr double kStep = 0.15;          // And to go a pixel aside.
constexpr int kReach = 3;               // How far aside a stripe goes from scan line to scan line.
constexpr int kShortest = 24;           // Scan lines of a piece that is kept,
constexpr int kTrimmed = 3;             // of which these at its ends are not judged.
constexpr double kStraightPx = 0.7;     // How well the knots describe the path.
constexpr double kEmptyPart = 0.6;      // Of the threshold: a dim red stripe is more.
constexpr double kEmptyGreen_dn = 6.5;  // And a dim green one.

/// By how much the laser's colour exceeds the others, its white core included; or how bright the
/// red is, where the room is dark and the core is wide.
cv::Mat colour_signal(const cv::Mat& bgr, const std::string& colour) {
  std::vector<cv::Mat> channels;
  cv::split(bgr, channels);
  cv::Mat excess = channels[colour == "green" ? 1 : 2];
  if (colour != "bright-red") {
    cv::Mat other;
    if (colour == "red") {
      other = cv::max(channels[0], channels[1]);
    } else {  // Of a bluish wall green exceeds red, and blue green; on wood both may be less.
      cv::addWeighted(channels[0], 0.5, channels[2], 0.5, 0.0, other);
      excess.convertTo(excess, CV_16S);
      other.convertTo(other, CV_16S);
    }
    cv::subtract(excess, other, excess);
  }
  if (colour == "red") {  // Only red cores are hollow in these images.
    cv::morphologyEx(excess, excess, cv::MORPH_CLOSE,
                     cv::getStructuringElement(cv::MORPH_RECT, {1, kCore}));
  }
  // What is as broad as a colour cast is no stripe.
  cv::Mat broad;
  cv::morphologyEx(
      excess, broad, cv::MORPH_OPEN,
      cv::getStructuringElement(cv::MORPH_RECT, {1, colour == "green" ? kCore : 3 * kCore}));
  cv::Mat signal;
  cv::subtract(excess, broad, signal);
  signal.convertTo(signal, CV_32F);
  cv::blur(signal, signal, {kAlong, 1});
  cv::GaussianBlur(signal, signal, {1, 13}, kAcross, kAcross);
  return signal;
}

/// Where the noise of the signal's own image ends: one and a half times its 97th percentile, or 4.
double threshold_of(const cv::Mat& signal) {
  std::vector<float> values(signal.begin<float>(), signal.end<float>());
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(0.97 * static_cast<double>(values.size()));
  std::nth_element(values.begin(), place, values.end());
  return std::max({4.0, 1.5 * static_cast<double>(*place)});
}

/// The best path: for every column its row, or -1 where leaving the stripe out is better.
std::vector<int> best_path(const cv::Mat& signal, double threshold) {
  const int none = signal.rows;  // The state without a stripe.
  std::vector<std::vector<int>> from(static_cast<std::size_t>(signal.cols));
  std::vector<double> score(static_cast<std::size_t>(none) + 1, 0.0);
  for (int u = 0; u < signal.cols; ++u) {
    const auto best = std::max_element(score.begin(), score.end());
    const int anywhere = static_cast<int>(best - score.begin());
    std::vector<double> next(score.size());
    std::vector<int>& back = from[static_cast<std::size_t>(u)];
    back.assign(score.size(), anywhere);
    for (int v = 0; v <= none; ++v) {
      double most = *best - (anywhere == v ? 0.0 : kJump);
      if (v == none && score[static_cast<std::size_t>(v)] >= most) {
        most = score[static_cast<std::size_t>(v)];
        back[static_cast<std::size_t>(v)] = v;
      }
      for (int w = std::max(0, v - kReach); v < none && w <= std::min(none - 1, v + kReach); ++w) {
        const double value = score[static_cast<std::size_t>(w)] - kStep * std::abs(v - w);
        if (value < most) continue;
        most = value;
        back[static_cast<std::size_t>(v)] = w;
      }
      const double gain = v == none ? 0.0 : signal.at<float>(v, u) / threshold - 1.0;
      next[static_cast<std::size_t>(v)] = most + std::min(gain, 3.0);
    }
    score = std::move(next);
  }
  std::vector<int> path(static_cast<std::size_t>(signal.cols));
  int state = static_cast<int>(std::max_element(score.begin(), score.end()) - score.begin());
  for (int u = signal.cols - 1; u >= 0; --u) {
    path[static_cast<std::size_t>(u)] = state == none ? -1 : state;
    state = from[static_cast<std::size_t>(u)][static_cast<std::size_t>(state)];
  }
  return path;
}

/// The middle of the signal about a row.
double centroid(const cv::Mat& signal, int column, int row) {
  double sum = 0.0;
  double moment = 0.0;
  for (int v = std::max(0, row - kHalfCore); v <= std::min(signal.rows - 1, row + kHalfCore); ++v) {
    const double weight =
        std::max(0.0, signal.at<float>(v, column) - 0.4 * signal.at<float>(row, column));
    sum += weight;
    moment += weight * v;
  }
  return sum > 0.0 ? moment / sum : row;
}

struct Point {
  int line;
  double at;
};

/// Douglas and Peucker's choice of knots.
void simplify(const std::vector<Point>& path, std::size_t first, std::size_t last,
              std::vector<Point>& knots) {
  double worst = kStraightPx;
  std::size_t where = 0;
  for (std::size_t i = first + 1; i < last; ++i) {
    const double share =
        static_cast<double>(path[i].line - path[first].line) / (path[last].line - path[first].line);
    const double off =
        std::abs(path[i].at - (path[first].at + share * (path[last].at - path[first].at)));
    if (off <= worst) continue;
    worst = off;
    where = i;
  }
  if (where > 0) {
    simplify(path, first, where, knots);
    simplify(path, where, last, knots);
  } else {
    knots.push_back(path[last]);
  }
}

/// Pieces of the path, each as knots.
std::vector<std::vector<Point>> pieces_of(const cv::Mat& signal, const std::vector<int>& path) {
  std::vector<std::vector<Point>> pieces;
  std::vector<Point> piece;
  const auto close = [&] {
    if (static_cast<int>(piece.size()) >= kShortest) {
      const std::vector<Point> kept(piece.begin() + kTrimmed, piece.end() - kTrimmed);
      std::vector<Point> knots = {kept.front()};
      simplify(kept, 0, kept.size() - 1, knots);
      pieces.push_back(knots);
    }
    piece.clear();
  };
  for (int u = 0; u < static_cast<int>(path.size()); ++u) {
    const int v = path[static_cast<std::size_t>(u)];
    const bool goes_on =
        v >= 0 && (piece.empty() || std::abs(v - path[static_cast<std::size_t>(u - 1)]) <= kReach);
    if (!goes_on) close();
    if (v >= 0) piece.push_back({u, centroid(signal, u, v)});
  }
  close();
  return pieces;
}

/// Scan lines in which nothing of the laser's colour is to be seen, as first and last.
std::vector<std::pair<int, int>> empty_lines(const cv::Mat& signal, const std::vector<int>& path,
                                             double least) {
  std::vector<std::pair<int, int>> ranges;
  int first = -1;
  for (int u = 0; u <= signal.cols; ++u) {
    double most = least;
    if (u < signal.cols) cv::minMaxIdx(signal.col(u), nullptr, &most);
    const bool is_empty = u < signal.cols && path[static_cast<std::size_t>(u)] < 0 && most < least;
    if (is_empty && first < 0) first = u;
    if (is_empty || first < 0) continue;
    if (u - first >= kShortest) ranges.emplace_back(first + kTrimmed, u - 1 - kTrimmed);
    first = -1;
  }
  return ranges;
}

void draw(const cv::Mat& upright, const std::vector<std::vector<Point>>& pieces,
          const std::vector<std::pair<int, int>>& empty, bool is_turned, const std::string& path) {
  cv::Mat image;
  cv::convertScaleAbs(upright, image, 0.7);
  cv::Mat beside = image.clone();
  for (const auto& piece : pieces) {
    for (std::size_t i = 1; i < piece.size(); ++i) {
      cv::line(beside, {piece[i - 1].line, cvRound(piece[i - 1].at)},
               {piece[i].line, cvRound(piece[i].at)}, {255, 255, 0}, 1);
    }
  }
  for (const auto& [first, last] : empty) cv::line(beside, {first, 2}, {last, 2}, {0, 255, 255}, 3);
  if (is_turned) cv::transpose(beside, beside);
  cv::imwrite(path, beside);
}

struct Set {
  std::string axis;
  std::string colour;
  double limit = 0.0;
  std::filesystem::path root;
};

void write_paths(const Set& set, const std::string& path) {
  const auto& [axis, colour, limit, root] = set;
  cv::Mat image = cv::imread(path, cv::IMREAD_COLOR);
  if (image.empty()) return;
  const bool is_turned = axis == "rows";
  if (is_turned) cv::transpose(image, image);
  const cv::Mat signal = colour_signal(image, colour);
  const double threshold = threshold_of(signal);
  const std::vector<int> line = best_path(signal, threshold);
  auto pieces = pieces_of(signal, line);
  std::erase_if(pieces, [&](const auto& piece) { return piece.front().at > set.limit; });
  const double least = colour == "green" ? kEmptyGreen_dn : kEmptyPart * threshold;
  const auto empty = empty_lines(signal, line, least);
  std::cout << fmt::format("picture {} {}\n", std::filesystem::relative(path, root).string(), axis);
  for (const auto& piece : pieces) {
    std::cout << "stripe";
    for (const Point& knot : piece) std::cout << fmt::format(" {} {:.1f}", knot.line, knot.at);
    std::cout << "\n";
  }
  for (const auto& [first, last] : empty) std::cout << fmt::format("empty {} {}\n", first, last);
  const char* folder = std::getenv("STRIPER_OVERLAYS");
  if (folder == nullptr) return;
  std::string name = std::filesystem::relative(path, root).string();
  std::replace(name.begin(), name.end(), '/', '_');
  draw(image, pieces, empty, is_turned,
       (std::filesystem::path(folder) / name).replace_extension("png").string());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6) {
    std::cerr << "real_stripe_paths rows|columns red|green|bright-red LIMIT FOLDER IMAGE...\n";
    return 1;
  }
  const Set set{argv[1], argv[2], std::atof(argv[3]), argv[4]};
  for (int i = 5; i < argc; ++i) write_paths(set, argv[i]);
}
