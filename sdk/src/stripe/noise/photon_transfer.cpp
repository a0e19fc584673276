// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/stripe/photon_transfer.hpp>

namespace striper {
namespace {

constexpr int kReach = 2047;  // Bins of differences on either side of 0.
constexpr int kDifferences = 2 * kReach + 1;
constexpr double kGate = 4.0;                     // Standard deviations.
constexpr double kVarianceInGate = 0.998929;      // Of a normal distribution cut there.
constexpr double kSigmaOfHalf = 1.0 / 1.3489795;  // Of the half in the middle.
constexpr double kLeastInPair = 200.0;            // Pixels of a level.
constexpr double kLeastInAll = 1000.0;
constexpr double kMostMisfit = 0.15;
// A curve where the line should be: misfit beyond what its images' number explains. Straight
// lines give 1.0 and .03, a gamma of .45 in eight images of 320x200 2.5 and .09.
constexpr double kMostScatter = 2.0;
constexpr double kMostMisfitOfCurve = 0.06;
// Scatter is beyond chance at so many standard deviations of its own.
constexpr double kBeyondChance = 3.0;
constexpr double kLeastContrast = 1.0 / 16.0;  // Of full scale,
constexpr double kMostUncertain = 0.1;         // or the slope is known to this part.

[[noreturn]] void refuse(const std::string& reason) {
  throw Error(ErrorKind::kUntrustworthy, reason);
}

// The shortest run of bins that holds half of all: what moves spreads the other half only.
struct Run {
  int first = 0;
  int last = kDifferences - 1;

  double middle() const { return 0.5 * (first + last); }
  double spread() const { return kSigmaOfHalf * (last - first + 1); }
};

Run shortest_half(const std::uint32_t* counts, double total) {
  Run best;
  double inside = 0.0;
  int first = 0;
  for (int last = 0; last < kDifferences; ++last) {
    inside += counts[last];
    while (inside - counts[first] >= 0.5 * total) inside -= counts[first++];
    if (inside >= 0.5 * total && last - first < best.last - best.first) best = {first, last};
  }
  return best;
}

struct Moments {
  int first = 0;  // The gate: bins from here
  int last = -1;  // to there.
  double count = 0.0;
  double mean = 0.0;      // Bins.
  double variance = 0.0;  // Bins^2.
};

// Of what lies within the gate; the bins at either end hold what is beyond them.
Moments moments_within(const std::uint32_t* counts, double middle, double spread) {
  const int first = std::max(1, static_cast<int>(std::ceil(middle - kGate * spread)));
  const int last =
      std::min(kDifferences - 2, static_cast<int>(std::floor(middle + kGate * spread)));
  Moments m;
  double sum = 0.0;
  double squares = 0.0;
  for (int bin = first; bin <= last; ++bin) {
    const double x = bin - middle;
    m.count += counts[bin];
    sum += x * counts[bin];
    squares += x * x * counts[bin];
  }
  if (m.count < 2.0) return {};
  m.first = first;
  m.last = last;
  m.mean = middle + sum / m.count;
  m.variance = (squares - sum * sum / m.count) / (m.count - 1.0) / kVarianceInGate;
  return m;
}

Moments moments_in_gate(const std::uint32_t* counts, double total) {
  const Run half = shortest_half(counts, total);
  const Moments rough = moments_within(counts, half.middle(), half.spread());
  return moments_within(counts, rough.mean, std::max(0.3, std::sqrt(rough.variance)));
}

// One point of the line.
struct Point {
  double level_dn;
  double variance;
  double count;  // Of differences that share no image, which tell as much.

  // One over the squared error of `variance`, where it is expected to be `expected`.
  double weight(double expected) const { return count / (2.0 * expected * expected); }
};

// Successive differences share an image: their squares have a correlation of 1/4 (Isserlis), so
// that those of n images tell as much as this part of as many that share none.
double independent_part(int pairs) { return 1.0 / (1.5 - 0.5 / std::max(1, pairs)); }

// variance = at_black + slope * (level - black), weighted by how well each variance is known.
struct Line {
  double at_black = 0.0;
  double slope = 0.0;
  double at_black_sigma = 0.0;
  double slope_sigma = 0.0;

  double at(double above_black) const { return at_black + slope * above_black; }
};

Line fit_line(const std::vector<Point>& points, double black_dn) {
  Line line;
  for (const Point& p : points) line.at_black += p.variance / static_cast<double>(points.size());
  constexpr int kRounds = 4;  // The weights need the line.
  for (int round = 0; round < kRounds; ++round) {
    double s = 0.0, sx = 0.0, sxx = 0.0, sy = 0.0, sxy = 0.0;
    for (const Point& p : points) {
      const double x = p.level_dn - black_dn;
      const double expected = std::max(line.at(x), 0.1 * p.variance + 1e-6);
      const double w = p.weight(expected);
      s += w;
      sx += w * x;
      sxx += w * x * x;
      sy += w * p.variance;
      sxy += w * x * p.variance;
    }
    const double det = s * sxx - sx * sx;
    if (!(det > 1e-12 * s * sxx))
      refuse("every pixel is as bright as every other: a noise line needs light and shade");
    line = {(sxx * sy - sx * sxy) / det, (s * sxy - sx * sy) / det, std::sqrt(sxx / det),
            std::sqrt(s / det)};
  }
  return line;
}

// By how much the points scatter more than their weights say (Birge's ratio).
double scatter_of(const std::vector<Point>& points, const Line& line, double black_dn) {
  if (points.size() < 3) return 1.0;
  double squares = 0.0;
  for (const Point& p : points) {
    const double expected = std::max(line.at(p.level_dn - black_dn), 0.1 * p.variance + 1e-6);
    squares += std::pow(p.variance - expected, 2.0) * p.weight(expected);
  }
  return std::sqrt(squares / static_cast<double>(points.size() - 2));
}

// What widens the bars: scatter that chance does not explain.
double widening(double scatter, std::size_t points) {
  const double chance = std::sqrt(0.5 / static_cast<double>(std::max<std::size_t>(points, 3) - 2));
  return scatter > 1.0 + kBeyondChance * chance ? scatter : 1.0;
}

double misfit_of(const std::vector<Point>& points, const Line& line, double black_dn) {
  double squares = 0.0;
  for (const Point& p : points) {
    squares += std::pow(p.variance / line.at(p.level_dn - black_dn) - 1.0, 2.0);
  }
  return std::sqrt(squares / static_cast<double>(points.size()));
}

// The line through the points, if they lie on one.
PhotonTransferFit fit_points(const std::vector<Point>& points, double black_level_dn,
                             int full_scale_dn) {
  const Line line = fit_line(points, black_level_dn);
  PhotonTransferFit fit;
  fit.lowest_dn = points.front().level_dn;
  fit.highest_dn = points.back().level_dn;
  const bool has_contrast = fit.highest_dn - fit.lowest_dn >= kLeastContrast * full_scale_dn;
  if (!has_contrast && line.slope_sigma > kMostUncertain * line.slope) {
    refuse(
        fmt::format("the light is between {:.0f} and {:.0f} DN: too even to tell shot noise from "
                    "read noise; show a scene with light and shade",
                    fit.lowest_dn, fit.highest_dn));
  }
  fit.misfit = misfit_of(points, line, black_level_dn);
  const double scatter = scatter_of(points, line, black_level_dn);
  const bool is_curve = fit.misfit > kMostMisfitOfCurve && scatter > kMostScatter;
  if (is_curve || !(fit.misfit <= kMostMisfit)) {
    refuse(
        fmt::format("the noise is off its line by {:.0f} %: are the images compressed, gamma "
                    "corrected or of changing exposure?",
                    100.0 * fit.misfit));
  }
  const double read2 = line.at_black - kRounding_dn2;
  if (read2 < -std::max(4.0 * line.at_black_sigma, 0.05)) {
    refuse(
        fmt::format("the noise would be below zero at the black level of {:g} DN: the true "
                    "black level is higher",
                    black_level_dn));
  }
  fit.noise.read_noise_dn = std::sqrt(std::max(0.0, read2));
  fit.noise.dn_per_electron = std::max(0.0, line.slope);
  fit.noise.black_level_dn = black_level_dn;
  fit.noise.bit_depth = std::bit_width(static_cast<unsigned>(full_scale_dn));
  const double excess = widening(scatter, points.size());
  fit.read_noise_sigma_dn =
      excess * line.at_black_sigma / (2.0 * std::max(fit.noise.read_noise_dn, 0.1));
  fit.dn_per_electron_sigma = excess * line.slope_sigma;
  return fit;
}

}  // namespace

void PhotonTransfer::add(const cv::Mat& image, int full_scale_dn, int stream) {
  const auto index = static_cast<std::size_t>(stream);
  if (index >= streams_.size()) streams_.resize(index + 1);
  Stream& s = streams_[index];
  require_same_kind(s, image, full_scale_dn);
  full_scale_dn_ = full_scale_dn;
  step_ = std::max(1, (full_scale_dn + 1) / 4096);
  ++images_;
  if (!s.before.empty()) {
    if (image.depth() == CV_8U) {
      take_in_pair<std::uint8_t>(s, image);
    } else {
      take_in_pair<std::uint16_t>(s, image);
    }
  }
  std::swap(s.before, s.last);
  image.copyTo(s.last);
}

void PhotonTransfer::require_same_kind(const Stream& stream, const cv::Mat& image,
                                       int full_scale_dn) const {
  const cv::Mat& last = stream.last;
  const bool is_same =
      last.empty() || (image.size() == last.size() && image.type() == last.type() &&
                       full_scale_dn == full_scale_dn_);
  if (is_same) return;
  throw Error(ErrorKind::kBadValue,
              fmt::format("an image of {}x{} pixels after one of {}x{}: expected the same size "
                          "and depth",
                          image.cols, image.rows, last.cols, last.rows));
}

// Hands on level, bin of the difference and mean of every pixel that is neither black nor clipped.
template <typename Pixel, typename OnPixel>
void PhotonTransfer::compare(const Stream& stream, const cv::Mat& now,
                             const OnPixel& on_pixel) const {
  for (int row = 0; row < now.rows; ++row) {
    const auto* const light = stream.before.ptr<Pixel>(row);
    const auto* const a = stream.last.ptr<Pixel>(row);
    const auto* const b = now.ptr<Pixel>(row);
    for (int col = 0; col < now.cols; ++col) {
      if (std::max(a[col], b[col]) >= full_scale_dn_ || std::min(a[col], b[col]) == 0) continue;
      const auto level = static_cast<std::size_t>(std::min<int>(light[col], full_scale_dn_)) *
                         kLevels / static_cast<std::size_t>(full_scale_dn_ + 1);
      const int difference =
          static_cast<int>(std::floor(static_cast<double>(b[col] - a[col]) / step_ + 0.5));
      on_pixel(level, std::clamp(difference + kReach, 0, kDifferences - 1),
               0.5 * (a[col] + b[col]));
    }
  }
}

template <typename Pixel>
void PhotonTransfer::take_in_pair(const Stream& stream, const cv::Mat& now) {
  histogram_.assign(static_cast<std::size_t>(kLevels) * kDifferences, 0);
  compare<Pixel>(stream, now, [&](std::size_t level, int bin, double) {
    ++histogram_[level * kDifferences + static_cast<std::size_t>(bin)];
  });
  std::array<Gate, kLevels> gates;
  for (std::size_t level = 0; level < kLevels; ++level) gates[level] = take_in_level(level);
  // What moves through a level is not of its brightness either.
  compare<Pixel>(stream, now, [&](std::size_t level, int bin, double value) {
    if (bin >= gates[level].first && bin <= gates[level].last) levels_[level].value_sum += value;
  });
}

PhotonTransfer::Gate PhotonTransfer::take_in_level(std::size_t level) {
  const std::uint32_t* const counts = &histogram_[level * kDifferences];
  double total = 0.0;
  for (int bin = 0; bin < kDifferences; ++bin) total += counts[bin];
  if (total < kLeastInPair) return {};
  const Moments m = moments_in_gate(counts, total);
  // Sheppard: bins wider than a DN add their own variance.
  const double coarse = step_ > 1 ? (step_ * step_ - 1.0) / 12.0 : 0.0;
  const double variance = 0.5 * std::max(0.0, m.variance * step_ * step_ - coarse);
  levels_[level].count += m.count;
  levels_[level].variance_sum += variance * m.count;
  return {m.first, m.last};
}

PhotonTransferFit PhotonTransfer::fit(double black_level_dn) const {
  if (images_ < kLeastImages) {
    refuse(fmt::format("{} dark images; at least {} are needed, {} are better", images_,
                       kLeastImages, 8 * kLeastImages));
  }
  const int streams = std::max(1, static_cast<int>(streams_.size()));
  const double independent = independent_part(images_ / streams - 2);
  std::vector<Point> points;
  double noise = 0.0;
  bool any_level = false;
  for (const Level& level : levels_) {
    if (level.count < kLeastInAll) continue;
    any_level = true;
    const Point p{level.value_sum / level.count, level.variance_sum / level.count,
                  level.count * independent};
    noise += p.variance;
    // The pixels of a level differ by the noise of the image that told it, too.
    const double reach = kGate * std::sqrt(2.0 * p.variance) + 1.0;
    if (p.level_dn - reach > 0.0 && p.level_dn + reach < full_scale_dn_) points.push_back(p);
  }
  if (any_level && !(noise > 0.0)) {
    refuse("the images are all the same: copies of one image, not exposures");
  }
  if (points.empty()) {
    refuse(
        "no brightness has enough pixels between black and white: change the exposure or the black "
        "level, or take more images");
  }
  PhotonTransferFit fit = fit_points(points, black_level_dn, full_scale_dn_);
  fit.pictures = images_;
  return fit;
}

}  // namespace striper
