// SPDX-License-Identifier: Apache-2.0
#include "stripe/paper_extractor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <striper/core/statistics.hpp>

#include "stripe/learn/laser_widths.hpp"
#include "stripe/noise/frame_noise.hpp"
#include "stripe/profile/ignored_pixels.hpp"
#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// Noise alone reaches 4.6 sigma in one column of 480 rows in a thousand; texture needs a margin.
constexpr double kAutomaticThresholdSigmas = 6.0;
constexpr double kLeastThresholdDn = 3.0;

// The local background is the mean of this many pixels on the darker side, this far from the peak's
// flank.
constexpr int kBackgroundGap = 3;
constexpr int kBackgroundPixels = 4;
constexpr int kLongestFlank = 40;

// A clipped run longer than this leaves the centre unknown to more than a pixel.
constexpr int kLongestClippedRun = 15;

constexpr double kFwhmOfSigma = 2.3548200450309493;  // 2 sqrt(2 ln 2).

// The probability that noise alone, in `length` independent pixels, stays below a peak of `snr`
// sigmas.
double probability_not_noise(double snr, int length) {
  return std::exp(length * std::log1p(-normal_above(snr)));
}

template <typename Pixel>
double mean_between(const LitLine<Pixel>& line, int first, int last) {
  double sum = 0.0;
  for (int k = first; k <= last; ++k) sum += line.value(k);
  return sum / (last - first + 1);
}

template <typename Pixel>
double darkest_pixel(const LitLine<Pixel>& line) {
  int darkest = line.value(0);
  for (int k = 1; k < line.length(); ++k) darkest = std::min(darkest, line.value(k));
  return darkest;
}

// The darker of the two sides just outside the peak [first, last]; the frame's edge may leave one
// side only, or none where the peak is as long as the scan line.
template <typename Pixel>
double local_background(const LitLine<Pixel>& line, int first, int last) {
  double background = std::numeric_limits<double>::infinity();
  const int below = first - kBackgroundGap;
  const int above = last + kBackgroundGap;
  if (below >= 0) {
    background = mean_between(line, std::max(0, below - kBackgroundPixels + 1), below);
  }
  if (above < line.length()) {
    const int end = std::min(line.length() - 1, above + kBackgroundPixels - 1);
    background = std::min(background, mean_between(line, above, end));
  }
  return std::isfinite(background) ? background : darkest_pixel(line);
}

// Distance in pixels from the plateau's end to where the profile falls to half, by linear
// interpolation.
template <typename Pixel>
double flank_length(const LitLine<Pixel>& line, int start, int direction, double half_level) {
  double previous = line.value(start);
  for (int step = 1; step <= kLongestFlank; ++step) {
    const int k = start + direction * step;
    if (k < 0 || k >= line.length()) return step - 1;
    const double value = line.value(k);
    if (value <= half_level) return step - 1 + (previous - half_level) / (previous - value);
    previous = value;
  }
  return kLongestFlank;
}

struct Plateau {
  int first;
  int last;
  int length() const { return last - first + 1; }
};

template <typename Pixel>
Plateau plateau_at(const LitLine<Pixel>& line, int row) {
  Plateau plateau{row, row};
  const int maximum = line.value(row);
  while (plateau.last + 1 < line.length() && line.value(plateau.last + 1) == maximum)
    ++plateau.last;
  return plateau;
}

struct Flanks {
  double before;
  double after;
};

template <typename Pixel>
Flanks measure_flanks(const LitLine<Pixel>& line, const Plateau& plateau, double half_level) {
  return {flank_length(line, plateau.first, -1, half_level),
          flank_length(line, plateau.last, +1, half_level)};
}

// The paper's sub-pixel position: the mean of three pixels weighted with their intensity. Where the
// maximum is several equal pixels the three are those around its middle.
template <typename Pixel>
double three_pixel_centroid(const LitLine<Pixel>& line, const Plateau& plateau) {
  if (plateau.length() > 1) {
    const double before = std::max(0, line.value(plateau.first - 1));
    const double after = std::max(0, line.value(plateau.last + 1));
    const double peak = std::max(1, line.value(plateau.first));
    const double middle = 0.5 * (plateau.first + plateau.last);
    return middle + (after - before) * 0.5 * (plateau.length() + 1) /
                        (before + peak * plateau.length() + after);
  }
  const int p = plateau.first;
  const double before = std::max(0, line.value(p - 1));
  const double peak = std::max(1, line.value(p));
  const double after = std::max(0, line.value(p + 1));
  return p + (after - before) / (before + peak + after);
}

}  // namespace

void PaperExtractor::extract(const LitFrame& frame, Stripe& stripe) {
  stripe.axis = options_.axis;
  stripe.grid = frame.grid;
  stripe.reset(line_count(frame.lit, options_.axis));
  if (line_length(frame.lit, options_.axis) < 3) return;
  if (frame.lit.depth() == CV_8U) {
    extract_lines<std::uint8_t>(frame, stripe);
  } else {
    extract_lines<std::uint16_t>(frame, stripe);
  }
}

template <typename Pixel>
void PaperExtractor::extract_lines(const LitFrame& frame, Stripe& stripe) {
  const double noise_dn = estimate_frame_noise(frame, options_.axis, differences_);
  const double threshold_dn = options_.threshold_dn.value_or(
      std::max(kLeastThresholdDn, kAutomaticThresholdSigmas * noise_dn));
  find_brightest<Pixel>(frame);
  for (int line = 0; line < static_cast<int>(stripe.size()); ++line) {
    measure_line<Pixel>(frame, line, noise_dn, threshold_dn, stripe);
  }
}

// Row by row whatever the axis: an image is read once, in the order it lies in memory.
template <typename Pixel>
void PaperExtractor::find_brightest(const LitFrame& frame) {
  const bool columns = options_.axis == StripeAxis::kColumns;
  const auto lines = static_cast<std::size_t>(line_count(frame.lit, options_.axis));
  brightest_.assign(lines, -1);
  maximum_.assign(lines, std::numeric_limits<std::int32_t>::min());
  const IgnoredPixels ignored(expected_of(options_, frame.laser), frame.grid);
  any_masked_.assign(lines, 0);
  for (int row = 0; row < frame.lit.rows; ++row) {
    const auto* const lit = frame.lit.ptr<Pixel>(row);
    const auto* const dark = frame.dark.empty() ? nullptr : frame.dark.ptr<Pixel>(row);
    const auto* const masked = frame.masked.empty() ? nullptr : frame.masked.ptr<std::uint8_t>(row);
    for (int column = 0; column < frame.lit.cols; ++column) {
      const auto line = static_cast<std::size_t>(columns ? column : row);
      if (masked != nullptr && masked[column] != 0) {
        any_masked_[line] = 1;
        continue;
      }
      if (ignored.has(column, row)) continue;
      const std::int32_t value = lit[column] - (dark != nullptr ? dark[column] : 0);
      if (value > maximum_[line]) {
        maximum_[line] = value;
        brightest_[line] = columns ? row : column;
      }
    }
  }
}

template <typename Pixel>
void PaperExtractor::measure_line(const LitFrame& frame, int line, double noise_dn,
                                  double threshold_dn, Stripe& stripe) const {
  const auto i = static_cast<std::size_t>(line);
  const LitLine<Pixel> pixels(frame, options_.axis, line);
  const int row = brightest_[i];
  // Where two images are subtracted, the mask has what is clipped in both.
  const bool is_clipped = frame.dark.empty() && row >= 0 && pixels.clipped(row);
  const bool is_masked = any_masked_[i] != 0 || is_clipped;
  stripe.status[i] = is_masked ? ReturnStatus::kBlind : ReturnStatus::kNoStripe;
  if (row < 0) return;

  const Plateau plateau = plateau_at(pixels, row);
  const double peak = pixels.value(row);
  // First from just outside the maximum, to learn how wide the peak is; then from outside its
  // flanks.
  double background = local_background(pixels, plateau.first, plateau.last);
  // Beside a masked region the brightest pixel that is left may lie below what surrounds it.
  if (!(peak > background)) return;
  Flanks flanks = measure_flanks(pixels, plateau, 0.5 * (peak + background));
  const int reach = static_cast<int>(std::ceil(flanks.before + flanks.after));
  background = local_background(pixels, plateau.first - reach, plateau.last + reach);
  flanks = measure_flanks(pixels, plateau, 0.5 * (peak + background));
  const double amplitude = peak - background;
  if (amplitude < threshold_dn) return;

  const AxisGrid& across = grid_across(frame.grid, options_.axis);
  const bool at_edge = plateau.first == 0 || plateau.last == pixels.length() - 1;
  const double position =
      at_edge ? 0.5 * (plateau.first + plateau.last) : three_pixel_centroid(pixels, plateau);
  const bool too_clipped = pixels.clipped(row) && plateau.length() > kLongestClippedRun;

  stripe.across_px[i] = across.sensor(position);
  stripe.sigma_px[i] = static_cast<float>(across.step / std::sqrt(12.0));
  stripe.amplitude_dn[i] = static_cast<float>(amplitude);
  stripe.width_px[i] = static_cast<float>(
      across.step * (flanks.before + flanks.after + plateau.length() - 1) / kFwhmOfSigma);
  stripe.confidence[i] =
      static_cast<float>(probability_not_noise(amplitude / noise_dn, pixels.length()));
  stripe.status[i] = at_edge       ? ReturnStatus::kEdge
                     : too_clipped ? ReturnStatus::kSaturated
                                   : ReturnStatus::kOk;
}

}  // namespace striper::detail
