// SPDX-License-Identifier: Apache-2.0
#include "stripe/background_noise.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "stripe/line_view.hpp"

namespace striper::detail {
namespace {

constexpr int kFirstSamples = 8192;
constexpr int kLaterSamples = 384;
constexpr int kLag = 2;
constexpr int kBins = 2048;               // Larger differences are counted as the largest.
constexpr int kAwayFromPeak = 16;         // Pixels.
constexpr std::uint32_t kLeastClean = 8;  // One sample in so many.
constexpr double kSigmaOfMedianAbsolute = 1.4826;
constexpr double kGain = 0.08;
constexpr double kJump = 0.25;
const double kQuantisation = std::sqrt(1.0 / 12.0);

// Of whole numbers |d|, number 0 covering half a step and every other one a whole step.
double median_of(const std::vector<std::uint32_t>& histogram, std::uint32_t total) {
  const double half = 0.5 * total;
  double below = 0.0;
  for (std::size_t bin = 0; bin < histogram.size(); ++bin) {
    const double count = histogram[bin];
    if (below + count >= half && count > 0.0) {
      const double within = (half - below) / count;
      return bin == 0 ? 0.5 * within : static_cast<double>(bin) - 0.5 + within;
    }
    below += count;
  }
  return 0.0;
}

}  // namespace

double BackgroundNoise::update(const LitFrame& frame, StripeAxis axis, const ChunkMaxima& peaks) {
  const auto measured = [&](int samples) {
    return frame.lit.depth() == CV_8U ? measure<std::uint8_t>(frame, axis, peaks, samples)
                                      : measure<std::uint16_t>(frame, axis, peaks, samples);
  };
  if (sigma_dn_ > 0.0) {
    const double now = measured(kLaterSamples);
    if (std::abs(now - sigma_dn_) <= kJump * sigma_dn_) {
      sigma_dn_ += kGain * (now - sigma_dn_);
      return sigma_dn_;
    }
  }
  sigma_dn_ = measured(kFirstSamples);
  return sigma_dn_;
}

template <typename Pixel>
double BackgroundNoise::measure(const LitFrame& frame, StripeAxis axis, const ChunkMaxima& peaks,
                                int samples) {
  const int lines = line_count(frame.lit, axis);
  const int inner = line_length(frame.lit, axis) - 2 * kLag;
  if (lines < 1 || inner < 1) return kQuantisation;
  histogram_.assign(kBins, 0);
  std::uint32_t total = 0;
  // What motion and edges leave is no noise; where they are everywhere it is all that can be seen.
  if (!frame.variance.empty()) {
    total = sample<Pixel>(frame, axis, peaks, samples, true);
    if (total < static_cast<std::uint32_t>(samples) / kLeastClean) {
      histogram_.assign(kBins, 0);
      total = 0;
    }
  }
  if (total == 0) total = sample<Pixel>(frame, axis, peaks, samples, false);
  if (total == 0) return kQuantisation;
  const double sigma = kSigmaOfMedianAbsolute * median_of(histogram_, total) / std::sqrt(6.0);
  return std::max(kQuantisation, sigma);
}

// Returns how many were counted.
template <typename Pixel>
std::uint32_t BackgroundNoise::sample(const LitFrame& frame, StripeAxis axis,
                                      const ChunkMaxima& peaks, int samples, bool only_clean) {
  const int lines = line_count(frame.lit, axis);
  const int inner = line_length(frame.lit, axis) - 2 * kLag;
  std::uint32_t total = 0;
  for (int n = 0; n < samples; ++n) {
    // Multiples of the golden ratio spread evenly over whatever they are taken modulo of.
    next_ += 0x9E3779B97F4A7C15ULL;
    const int line_number =
        static_cast<int>((next_ >> 32) * static_cast<std::uint64_t>(lines) >> 32);
    const int k = kLag + static_cast<int>(((next_ * 0xD1B54A32D192ED03ULL) >> 32) *
                                              static_cast<std::uint64_t>(inner) >>
                                          32);
    if (std::abs(k - peaks.best(0, line_number).across) < kAwayFromPeak) continue;
    if (only_clean && image_line<float>(frame.variance, axis, line_number)[k] > 0.0F) continue;
    const LitLine<Pixel> line(frame, axis, line_number);
    if (line.clipped(k - kLag) || line.clipped(k) || line.clipped(k + kLag)) continue;
    if (line.blind(k - kLag) || line.blind(k) || line.blind(k + kLag)) continue;
    const int d = std::abs(line.value(k - kLag) - 2 * line.value(k) + line.value(k + kLag));
    ++histogram_[static_cast<std::size_t>(std::min(d, kBins - 1))];
    ++total;
  }
  return total;
}

}  // namespace striper::detail
