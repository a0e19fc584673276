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
// Successive differences share a picture.
constexpr double kSharing = 1.5;
constexpr double kMostMisfit = 0.15;
constexpr double kLeastContrast = 1.0 / 16.0;  // Of full scale,
constexpr double kMostUncertain = 0.1;         // or the slope is known to this part.
constexpr double kQuantisation = 1.0 / 12.0;

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
  double count;
};

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
      const double w = p.count / (2.0 * kSharing * expected * expected);
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

double misfit_of(const std::vector<Point>& points, const Line& line, double black_dn) {
  double squares = 0.0;
  for (const Point& p : points) {
    squares += std::pow(p.variance / line.at(p.level_dn - black_dn) - 1.0, 2.0);
  }
  return std::sqrt(squares / static_cast<double>(points.size()));
}

}  // namespace

void PhotonTransfer::add(const cv::Mat& image, int full_scale_dn, int stream) {
  const auto index = static_cast<std::size_t>(stream);
  if (index >= last_.size()) last_.resize(index + 1);
  cv::Mat& last = last_[index];
  if (!last.empty() && (image.size() != last.size() || image.type() != last.type() ||
                        full_scale_dn != full_scale_dn_)) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("a picture of {}x{} pixels after one of {}x{}: expected the same size "
                            "and depth",
                            image.cols, image.rows, last.cols, last.rows));
  }
  full_scale_dn_ = full_scale_dn;
  step_ = std::max(1, (full_scale_dn + 1) / 4096);
  ++pictures_;
  if (!last.empty()) {
    histogram_.assign(static_cast<std::size_t>(kLevels) * kDifferences, 0);
    value_sums_.fill(0.0);
    if (image.depth() == CV_8U) {
      compare<std::uint8_t>(last, image);
    } else {
      compare<std::uint16_t>(last, image);
    }
    take_in_pair();
  }
  image.copyTo(last);
}

template <typename Pixel>
void PhotonTransfer::compare(const cv::Mat& before, const cv::Mat& now) {
  for (int row = 0; row < now.rows; ++row) {
    const auto* const a = before.ptr<Pixel>(row);
    const auto* const b = now.ptr<Pixel>(row);
    for (int col = 0; col < now.cols; ++col) {
      const int sum = a[col] + b[col];
      if (std::max(a[col], b[col]) >= full_scale_dn_ || std::min(a[col], b[col]) == 0) continue;
      // The sum does not depend on the difference: sorting by it does not choose among the noise.
      const auto level = static_cast<std::size_t>(static_cast<std::int64_t>(sum) * kLevels /
                                                  (2 * (full_scale_dn_ + 1)));
      const int difference =
          static_cast<int>(std::floor(static_cast<double>(b[col] - a[col]) / step_ + 0.5));
      const int bin = std::clamp(difference + kReach, 0, kDifferences - 1);
      ++histogram_[level * kDifferences + static_cast<std::size_t>(bin)];
      value_sums_[level] += 0.5 * sum;
    }
  }
}

void PhotonTransfer::take_in_pair() {
  for (std::size_t level = 0; level < kLevels; ++level) take_in_level(level);
}

void PhotonTransfer::take_in_level(std::size_t level) {
  const std::uint32_t* const counts = &histogram_[level * kDifferences];
  double total = 0.0;
  for (int bin = 0; bin < kDifferences; ++bin) total += counts[bin];
  if (total < kLeastInPair) return;
  const Moments m = moments_in_gate(counts, total);
  // Sheppard: bins wider than a DN add their own variance.
  const double coarse = step_ > 1 ? (step_ * step_ - 1.0) / 12.0 : 0.0;
  const double variance = 0.5 * std::max(0.0, m.variance * step_ * step_ - coarse);
  levels_[level].count += m.count;
  levels_[level].value_sum += value_sums_[level] / total * m.count;
  levels_[level].variance_sum += variance * m.count;
}

PhotonTransferFit PhotonTransfer::fit(double black_level_dn) const {
  if (pictures_ < kLeastPictures) {
    refuse(fmt::format("{} dark pictures; at least {} are needed, {} are better", pictures_,
                       kLeastPictures, 8 * kLeastPictures));
  }
  std::vector<Point> points;
  double noise = 0.0;
  bool any_level = false;
  for (const Level& level : levels_) {
    if (level.count < kLeastInAll) continue;
    any_level = true;
    const Point p{level.value_sum / level.count, level.variance_sum / level.count, level.count};
    noise += p.variance;
    const double reach = kGate * std::sqrt(p.variance) + 1.0;
    if (p.level_dn - reach > 0.0 && p.level_dn + reach < full_scale_dn_) points.push_back(p);
  }
  if (any_level && !(noise > 0.0)) {
    refuse("the pictures are all the same: copies of one picture, not exposures");
  }
  if (points.empty()) {
    refuse(
        "no brightness has enough pixels between black and white: change the exposure or the black "
        "level, or take more pictures");
  }
  const Line line = fit_line(points, black_level_dn);
  PhotonTransferFit fit;
  fit.pictures = pictures_;
  fit.lowest_dn = points.front().level_dn;
  fit.highest_dn = points.back().level_dn;
  const bool has_contrast = fit.highest_dn - fit.lowest_dn >= kLeastContrast * full_scale_dn_;
  if (!has_contrast && line.slope_sigma > kMostUncertain * line.slope) {
    refuse(
        fmt::format("the light is between {:.0f} and {:.0f} DN: too even to tell shot noise from "
                    "read noise; show a scene with light and shade",
                    fit.lowest_dn, fit.highest_dn));
  }
  fit.misfit = misfit_of(points, line, black_level_dn);
  if (!(fit.misfit <= kMostMisfit)) {
    refuse(
        fmt::format("the noise is off its line by {:.0f} %: are the pictures compressed, gamma "
                    "corrected or of changing exposure?",
                    100.0 * fit.misfit));
  }
  const double read2 = line.at_black - kQuantisation;
  if (read2 < -std::max(4.0 * line.at_black_sigma, 0.05)) {
    refuse(
        fmt::format("the noise would be below zero at the black level of {:g} DN: the true "
                    "black level is higher",
                    black_level_dn));
  }
  fit.noise.read_noise_dn = std::sqrt(std::max(0.0, read2));
  fit.noise.dn_per_electron = std::max(0.0, line.slope);
  fit.noise.black_level_dn = black_level_dn;
  fit.noise.bit_depth = std::bit_width(static_cast<unsigned>(full_scale_dn_));
  fit.read_noise_sigma_dn = line.at_black_sigma / (2.0 * std::max(fit.noise.read_noise_dn, 0.1));
  fit.dn_per_electron_sigma = line.slope_sigma;
  return fit;
}

}  // namespace striper
