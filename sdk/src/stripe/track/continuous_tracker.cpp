// SPDX-License-Identifier: Apache-2.0
#include "stripe/track/continuous_tracker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// From one scan line to the next.
constexpr int kMostSlope = 3;
constexpr std::array<float, 2 * kMostSlope + 1> kSlopes{0.001F, 0.029F, 0.235F, 0.47F,
                                                        0.235F, 0.029F, 0.001F};
constexpr float kPresentAtFirst = 0.05F;
constexpr float kJump = 0.005F;
constexpr float kVanish = 0.004F;
constexpr float kAppear = 0.00005F;

// Amplitudes of the stripe in standard deviations of the filter's noise, and their weights. Weak
// ones weigh more: strong ones convince anyway.
struct Amplitude {
  double value;
  double weight;
};
constexpr std::array<Amplitude, 4> kAmplitudes{{{1.9, 0.65}, {2.9, 0.2}, {4.3, 0.1}, {6.3, 0.05}}};
// Stronger than this, continuity may still overrule a scan line: a specular highlight is strong as
// well.
constexpr double kStrongest = 9.0;
constexpr double kTableStep = 1.0 / 16.0;
constexpr double kTableLow = -8.0;
constexpr std::size_t kTableSize =
    static_cast<std::size_t>((kStrongest - kTableLow) / kTableStep) + 2;

std::array<float, kTableSize> make_likelihood_table() {
  std::array<float, kTableSize> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double z = kTableLow + kTableStep * static_cast<double>(i);
    double sum = 0.0;
    for (const auto& [a, weight] : kAmplitudes) sum += weight * std::exp(a * z - 0.5 * a * a);
    table[i] = static_cast<float>(sum);
  }
  return table;
}

float likelihood_ratio(float z) {
  static const std::array<float, kTableSize> kTable = make_likelihood_table();
  const double at = (static_cast<double>(z) - kTableLow) / kTableStep;
  const double clamped = std::clamp(at, 0.0, static_cast<double>(kTableSize - 1));
  return kTable[static_cast<std::size_t>(clamped)];
}

}  // namespace

void ContinuousTracker::track(const LitFrame& frame, StripeAxis axis, double width,
                              const PlanNoise& noise, std::span<const Run> runs) {
  lines_ = line_count(frame.lit, axis);
  length_ = line_length(frame.lit, axis);
  const std::size_t states = static_cast<std::size_t>(lines_) * static_cast<std::size_t>(length_);
  evidence_.resize(states);
  forward_.resize(states);
  absent_.resize(static_cast<std::size_t>(lines_));
  answers_.assign(static_cast<std::size_t>(lines_), {});
  for (std::vector<float>* buffer : {&scratch_, &backward_, &spread_}) {
    buffer->resize(static_cast<std::size_t>(length_ + 2 * kMostSlope));
  }
  make_filter(width);
  // Room for a scan line now: the first frames may have no run.
  const auto padded = static_cast<std::size_t>(length_ + 2 * half_window_);
  for (std::vector<float>* buffer : {&padded_, &white_, &extra_, &trust_, &answer_variance_}) {
    buffer->reserve(padded);
  }
  hidden_.reserve(padded);
  for (const Run& run : runs) {
    if (frame.lit.depth() == CV_8U) {
      find_evidence<std::uint8_t>(frame, axis, noise, run);
    } else {
      find_evidence<std::uint16_t>(frame, axis, noise, run);
    }
    run_forward(run);
    run_backward(run);
  }
}

float* ContinuousTracker::row_of(std::vector<float>& table, int line) {
  return table.data() + static_cast<std::ptrdiff_t>(line) * length_;
}

// A Gaussian minus its mean over the window, so that backgrounds and their slopes cancel: a core
// over a flat rest. Scaled to answer noise with its own standard deviation.
void ContinuousTracker::make_filter(double width) {
  taps_ = static_cast<int>(std::ceil(3.0 * width));
  half_window_ = static_cast<int>(std::ceil(5.0 * width)) + 20;
  reach_ = std::max(2, static_cast<int>(std::lround(2.0 * width)));
  core_.clear();
  for (int i = -taps_; i <= taps_; ++i) {
    core_.push_back(static_cast<float>(std::exp(-0.5 * i * i / (width * width))));
  }
  const double sum = std::accumulate(core_.begin(), core_.end(), 0.0);
  const double squares = std::inner_product(core_.begin(), core_.end(), core_.begin(), 0.0);
  const double mean = sum / (2 * half_window_ + 1);
  const auto scale = static_cast<float>(1.0 / std::sqrt(squares - mean * sum));
  flat_ = -static_cast<float>(mean) * scale;
  core_squared_.clear();
  for (float& tap : core_) {
    core_squared_.push_back(tap * tap / static_cast<float>(squares));
    tap *= scale;
  }
}

// Of a scan line whose ends are repeated by half a window.
void ContinuousTracker::correlate(const std::vector<float>& padded, const std::vector<float>& taps,
                                  float* out) const {
  std::fill_n(out, length_, 0.0F);
  const float* from = padded.data() + half_window_ - taps_;
  for (const float tap : taps) {
    for (int k = 0; k < length_; ++k) out[k] += tap * from[k];
    ++from;
  }
}

template <typename Pixel>
void ContinuousTracker::load_line(const LitFrame& frame, StripeAxis axis, int line_number) {
  const LitLine<Pixel> line(frame, axis, line_number);
  padded_.resize(static_cast<std::size_t>(length_ + 2 * half_window_));
  hidden_.assign(static_cast<std::size_t>(length_), 0);
  float last_seen = 0.0F;
  for (int k = 0; k < length_; ++k) {
    const bool hidden = line.masked(k);
    hidden_[static_cast<std::size_t>(k)] = hidden ? 1 : 0;
    if (!hidden) last_seen = static_cast<float>(line.value(k));
    padded_[static_cast<std::size_t>(k + half_window_)] = last_seen;
  }
  repeat_ends(padded_);
}

void ContinuousTracker::repeat_ends(std::vector<float>& padded) const {
  const auto first = padded.begin() + half_window_;
  std::fill(padded.begin(), first, *first);
  std::fill(first + length_, padded.end(), *(first + length_ - 1));
}

// The variance of the filter's answer at each pixel of a scan line. What motion and edges leave
// goes together over the filter, as texture does; noise does not.
template <typename Pixel>
void ContinuousTracker::load_noise(const LitFrame& frame, StripeAxis axis, int line_number,
                                   const PlanNoise& noise) {
  const NoiseModel& model = noise.model;
  const bool is_uniform = model.dn_per_electron == 0.0;
  const double dark_gain =
      dark_gain_through(noise, std::span(core_).last(static_cast<std::size_t>(taps_) + 1));
  const double floor = (1.0 + dark_gain) * model.variance_dn2(0.0);
  answer_variance_.assign(static_cast<std::size_t>(length_), static_cast<float>(floor));
  const auto padded_length = static_cast<std::size_t>(length_ + 2 * half_window_);
  if (!is_uniform) {
    const LitLine<Pixel> line(frame, axis, line_number);
    white_.resize(padded_length);
    for (int k = 0; k < length_; ++k) {
      const double variance =
          model.variance_dn2(line.lit(k)) + dark_gain * model.variance_dn2(line.dark(k));
      white_[static_cast<std::size_t>(k + half_window_)] = static_cast<float>(variance);
    }
    repeat_ends(white_);
    correlate(white_, core_squared_, answer_variance_.data());
  }
  if (frame.variance.empty()) return;
  const StridedLine<const float> variance = image_line<float>(frame.variance, axis, line_number);
  extra_.resize(padded_length);
  trust_.resize(padded_length);
  for (int k = 0; k < length_; ++k) {
    const auto i = static_cast<std::size_t>(k + half_window_);
    extra_[i] = std::sqrt(variance[k]);
    trust_[i] = static_cast<float>(floor) / (static_cast<float>(floor) + variance[k]);
  }
  repeat_ends(extra_);
  repeat_ends(trust_);
  correlate(extra_, core_, scratch_.data());
  for (int k = 0; k < length_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    answer_variance_[i] += scratch_[i] * scratch_[i];
  }
}

// The sum of the window about each pixel; where motion and edges have left more than noise, what
// the mean of the pixels that can be trusted makes of it.
void ContinuousTracker::sum_windows(bool has_extra, float* sums) {
  const int window = 2 * half_window_ + 1;
  double sum = 0.0;
  double trust = 0.0;
  const auto add = [&](int k, double sign) {
    const auto i = static_cast<std::size_t>(k);
    const double weight = has_extra ? sign * static_cast<double>(trust_[i]) : sign;
    sum += weight * static_cast<double>(padded_[i]);
    trust += weight;
  };
  for (int k = 0; k < window; ++k) add(k, 1.0);
  for (int k = 0; k < length_; ++k) {
    sums[k] = static_cast<float>(sum / trust * window);
    if (k + 1 == length_) break;
    add(k + window, 1.0);
    add(k, -1.0);
  }
}

// The core of the filter tap by tap, its flat rest from the sum of the window.
void ContinuousTracker::filter_line(bool has_extra, float* evidence) {
  correlate(padded_, core_, scratch_.data());
  sum_windows(has_extra, spread_.data());
  for (int k = 0; k < length_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float answer = scratch_[i] + flat_ * spread_[i];
    evidence[k] =
        hidden_[i] != 0 ? 1.0F : likelihood_ratio(answer / std::sqrt(answer_variance_[i]));
  }
}

template <typename Pixel>
void ContinuousTracker::find_evidence(const LitFrame& frame, StripeAxis axis,
                                      const PlanNoise& noise, const Run& run) {
  for (int line = run.first; line < run.end; ++line) {
    load_line<Pixel>(frame, axis, line);
    load_noise<Pixel>(frame, axis, line, noise);
    filter_line(!frame.variance.empty(), row_of(evidence_, line));
  }
}

// The chain's step from one scan line to the next, the same in both directions: it is symmetric.
void ContinuousTracker::step(const float* previous, float previous_absent, float* next,
                             float& next_absent) {
  float* const padded = spread_.data() + kMostSlope;
  std::fill_n(spread_.data(), kMostSlope, 0.0F);
  std::copy_n(previous, length_, padded);
  std::fill_n(padded + length_, kMostSlope, 0.0F);
  const float present = std::accumulate(previous, previous + length_, 0.0F);
  const float anywhere =
      (kJump * present + kAppear * previous_absent) / static_cast<float>(length_);
  constexpr float kStays = 1.0F - kJump - kVanish;
  std::fill_n(next, length_, anywhere);
  for (int d = -kMostSlope; d <= kMostSlope; ++d) {
    const float weight = kStays * kSlopes[static_cast<std::size_t>(d + kMostSlope)];
    const float* const from = padded + d;
    for (int k = 0; k < length_; ++k) next[k] += weight * from[k];
  }
  next_absent = kVanish * present + (1.0F - kAppear) * previous_absent;
}

void ContinuousTracker::normalise(float* present, float& absent) const {
  const float sum = std::accumulate(present, present + length_, absent);
  const float scale = 1.0F / std::max(sum, 1e-30F);
  for (int k = 0; k < length_; ++k) present[k] *= scale;
  absent *= scale;
}

void ContinuousTracker::run_forward(const Run& run) {
  for (int line = run.first; line < run.end; ++line) {
    float* const now = row_of(forward_, line);
    float& absent = absent_[static_cast<std::size_t>(line)];
    if (line == run.first) {
      std::fill_n(now, length_, kPresentAtFirst / static_cast<float>(length_));
      absent = 1.0F - kPresentAtFirst;
    } else {
      step(row_of(forward_, line - 1), absent_[static_cast<std::size_t>(line) - 1], now, absent);
    }
    const float* const evidence = row_of(evidence_, line);
    for (int k = 0; k < length_; ++k) now[k] *= evidence[k];
    normalise(now, absent);
  }
}

void ContinuousTracker::run_backward(const Run& run) {
  float absent = 1.0F;
  std::fill_n(backward_.data(), length_, 1.0F);
  for (int line = run.end - 1; line >= run.first; --line) {
    decide(line, backward_.data(), absent);
    const float* const evidence = row_of(evidence_, line);
    for (int k = 0; k < length_; ++k) backward_[static_cast<std::size_t>(k)] *= evidence[k];
    // Backward, "anywhere" weighs what is reached from one pixel: the mean over all pixels.
    float next_absent = 0.0F;
    const float jump = std::accumulate(backward_.begin(), backward_.begin() + length_, 0.0F) /
                       static_cast<float>(length_);
    step(backward_.data(), 0.0F, scratch_.data(), next_absent);
    for (int k = 0; k < length_; ++k) scratch_[static_cast<std::size_t>(k)] += kVanish * absent;
    absent = kAppear * jump + (1.0F - kAppear) * absent;
    normalise(scratch_.data(), absent);
    std::swap(scratch_, backward_);
  }
}

// The pixel about which most of the probability lies within two widths.
void ContinuousTracker::decide(int line, const float* backward, float backward_absent) {
  const float* const forward = row_of(forward_, line);
  double total = static_cast<double>(absent_[static_cast<std::size_t>(line)] * backward_absent);
  for (int k = 0; k < length_; ++k) {
    spread_[static_cast<std::size_t>(k)] = forward[k] * backward[k];
    total += static_cast<double>(spread_[static_cast<std::size_t>(k)]);
  }
  if (!(total > 0.0)) return;
  const auto best = std::max_element(spread_.begin(), spread_.begin() + length_) - spread_.begin();
  const auto first = std::max<std::ptrdiff_t>(0, best - reach_);
  const auto last = std::min<std::ptrdiff_t>(length_ - 1, best + reach_);
  double sum = 0.0;
  double moment = 0.0;
  for (auto k = first; k <= last; ++k) {
    const double p = static_cast<double>(spread_[static_cast<std::size_t>(k)]);
    sum += p;
    moment += p * static_cast<double>(k);
  }
  answers_[static_cast<std::size_t>(line)] = {static_cast<std::int32_t>(std::lround(moment / sum)),
                                              static_cast<float>(sum / total)};
}

}  // namespace striper::detail
