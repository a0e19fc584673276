// SPDX-License-Identifier: Apache-2.0
#include "stripe/noise/background_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include <striper/core/noise_model.hpp>
#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

constexpr int kFirstSamples = 8192;
constexpr int kLaterSamples = 192;
constexpr int kRun =
    16;  // Neighbouring scan lines looked at together: their pixels share cache lines.
constexpr int kLag = 2;
constexpr int kBins = 2048;               // Larger differences are counted as the largest.
constexpr int kAwayFromPeak = 16;         // Pixels.
constexpr std::uint32_t kLeastClean = 8;  // One sample in so many.
constexpr unsigned kEvery = 2;            // Frames.
constexpr double kGain = 0.08;
constexpr double kJump = 0.25;
const double kRounding_dn = std::sqrt(kRounding_dn2);

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

std::size_t index(int i) { return static_cast<std::size_t>(i); }

// Hands on what is compared: a pixel of each of `count` scan lines and those kLag before and after
// it.
template <typename Pixel, typename Action>
void for_each_bend(const Pixel* middle, const ProfileImages::Steps& steps, int count,
                   const Action& action) {
  const Pixel* const before = middle - kLag * steps.across;
  const Pixel* const after = middle + kLag * steps.across;
  if (steps.line == 1) {  // So that the compiler reads them a vector at a time.
    for (int i = 0; i < count; ++i) action(i, before[i], middle[i], after[i]);
    return;
  }
  for (int i = 0; i < count; ++i) {
    const std::ptrdiff_t at = i * steps.line;
    action(i, before[at], middle[at], after[at]);
  }
}

}  // namespace

double BackgroundNoise::update(const ProfileImages& images, const std::vector<std::int32_t>& peaks,
                               double exposures) {
  const auto measured = [&](int samples) {
    const double of_all = images.is_16_bit ? measure<std::uint16_t>(images, peaks, samples)
                                           : measure<std::uint8_t>(images, peaks, samples);
    return std::max(kRounding_dn, of_all / std::sqrt(exposures));
  };
  if (sigma_dn_ > 0.0) {
    if (++frames_ % kEvery != 0) return sigma_dn_;
    const double now = measured(kLaterSamples);
    if (std::abs(now - sigma_dn_) <= kJump * sigma_dn_) {
      sigma_dn_ += kGain * (now - sigma_dn_);
      return sigma_dn_;
    }
  }
  sigma_dn_ = measured(kFirstSamples);
  return sigma_dn_;
}

double BackgroundNoise::part_seen(const std::array<float, 3>& correlation) noexcept {
  // Of 6 variances of x(k-2) - 2 x(k) + x(k+2), less 8 covariances of pixels kLag apart.
  return 1.0 - 8.0 / 6.0 * static_cast<double>(correlation[kLag - 1]);
}

template <typename Pixel>
double BackgroundNoise::measure(const ProfileImages& images, const std::vector<std::int32_t>& peaks,
                                int samples) {
  if (peaks.empty() || images.length <= 2 * kLag) return kRounding_dn;
  // What motion and edges leave is no noise; where they are everywhere it is all that can be seen.
  const bool has_variance = images.variance != nullptr;
  sample<Pixel>(images, peaks, samples, has_variance);
  if (has_variance && total_ < static_cast<std::uint32_t>(samples) / kLeastClean) {
    sample<Pixel>(images, peaks, samples, false);
  }
  if (total_ == 0) return kRounding_dn;
  const double sigma = kSigmaOfMedianAbsolute * median_of(histogram_, total_) / std::sqrt(6.0);
  return std::max(kRounding_dn, sigma);
}

template <typename Pixel>
void BackgroundNoise::sample(const ProfileImages& images, const std::vector<std::int32_t>& peaks,
                             int samples, bool only_clean) {
  histogram_.assign(kBins, 0);
  total_ = 0;
  const auto lines = static_cast<int>(peaks.size());
  const auto inner = static_cast<std::uint64_t>(images.length - 2 * kLag);
  const int run = std::min(kRun, lines);
  const auto starts = static_cast<std::uint64_t>(lines - run + 1);
  for (int n = 0; n < samples; n += run) {
    // Multiples of the golden ratio spread evenly over whatever they are taken modulo of.
    next_ += 0x9E3779B97F4A7C15ULL;
    const int line = static_cast<int>((next_ >> 32) * starts >> 32);
    const int k = kLag + static_cast<int>(((next_ * 0xD1B54A32D192ED03ULL) >> 32) * inner >> 32);
    count_run<Pixel>(images, peaks.data() + line, line, k, run, only_clean);
  }
}

template <typename Pixel>
void BackgroundNoise::count_run(const ProfileImages& images, const std::int32_t* peaks, int line,
                                int across, int count, bool only_clean) {
  const auto place = [&](const ProfileImages::Steps& steps) {
    return line * steps.line + across * steps.across;
  };
  std::array<int, kRun> difference{};
  std::array<int, kRun> tells{};  // 1 where the difference tells anything.
  for (int i = 0; i < count; ++i) {
    tells[index(i)] = static_cast<int>(std::abs(across - peaks[i]) >= kAwayFromPeak);
  }
  const auto* const lit = static_cast<const Pixel*>(images.lit) + place(images.lit_steps);
  for_each_bend(lit, images.lit_steps, count, [&](int i, int a, int b, int c) {
    difference[index(i)] = a - 2 * b + c;
    tells[index(i)] &= static_cast<int>(std::max(a, std::max(b, c)) < images.full_scale_dn);
  });
  if (images.dark != nullptr) {
    const auto* const dark = static_cast<const Pixel*>(images.dark) + place(images.dark_steps);
    for_each_bend(dark, images.dark_steps, count,
                  [&](int i, int a, int b, int c) { difference[index(i)] -= a - 2 * b + c; });
  }
  if (images.masked != nullptr) {
    const std::uint8_t* const masked = images.masked + place(images.masked_steps);
    for_each_bend(masked, images.masked_steps, count, [&](int i, int a, int b, int c) {
      tells[index(i)] &= static_cast<int>((a | b | c) == 0);
    });
  }
  if (only_clean) {
    const float* const variance = images.variance + place(images.variance_steps);
    for (int i = 0; i < count; ++i) {
      tells[index(i)] &= static_cast<int>(!(variance[i * images.variance_steps.line] > 0.0F));
    }
  }
  for (int i = 0; i < count; ++i) {
    const int bin = std::min(std::abs(difference[index(i)]), kBins - 1);
    histogram_[index(bin)] += static_cast<std::uint32_t>(tells[index(i)]);
    total_ += static_cast<std::uint32_t>(tells[index(i)]);
  }
}

}  // namespace striper::detail
