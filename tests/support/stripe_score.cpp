// SPDX-License-Identifier: Apache-2.0
#include "support/stripe_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace striper::testing {
namespace {

constexpr double kRightPx = 0.5;
constexpr double kMixedPx = 4.0;
constexpr int kMixedLines = 4;      // As Scene::edge_distance_px.
constexpr double kOwnWidths = 4.0;  // So far from a true return its own light reaches.

bool is_right(double error_px, double sigma_px) {
  return std::abs(error_px) <= std::max(kRightPx, 3.0 * sigma_px);
}

double across(const TrueReturn& truth, StripeAxis axis) {
  return axis == StripeAxis::kColumns ? truth.v_px : truth.u_px;
}

template <typename Visit>
void for_each_true(const TrueLine& line, const Visit& visit) {
  if (line.status != TruthStatus::kVisible) return;
  visit(line.brightest);
  for (const TrueReturn& other : line.others) visit(other);
}

double nearest_error(const TrueLine& line, StripeAxis axis, double at) {
  double nearest = std::numeric_limits<double>::quiet_NaN();
  for_each_true(line, [&](const TrueReturn& truth) {
    const double error = at - across(truth, axis);
    if (!(std::abs(error) >= std::abs(nearest))) nearest = error;
  });
  return nearest;
}

bool is_mixed(const Truth& truth, int line, double at) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  double nearest = low;
  bool is_edge = truth.lines[static_cast<std::size_t>(line)].status != TruthStatus::kVisible;
  const int last = std::min(static_cast<int>(truth.lines.size()) - 1, line + kMixedLines);
  for (int i = std::max(0, line - kMixedLines); i <= last; ++i) {
    for_each_true(truth.lines[static_cast<std::size_t>(i)], [&](const TrueReturn& t) {
      const double v = across(t, truth.axis);
      low = std::min(low, v);
      high = std::max(high, v);
      nearest = std::min(nearest, std::abs(v - at));
      is_edge |= i == line && t.near_edge;
    });
  }
  return is_edge && nearest <= kMixedPx && at >= low - kRightPx && at <= high + kRightPx;
}

// Mean square of what the background has of a stripe's width around the stripe: each pixel over the
// mean of those two and a half widths before and after it across, which leaves a stripe's peak as
// it is and nothing of a ramp.
double texture_dn2(const TrueReturn& truth, const cv::Mat& background_dn, StripeAxis axis) {
  constexpr double kWidthsBeside = 2.5;
  constexpr double kWidthsAround = 10.0;
  constexpr int kLinesAround = 4;
  const bool is_column = axis == StripeAxis::kColumns;
  const int length = is_column ? background_dn.rows : background_dn.cols;
  const int lines = is_column ? background_dn.cols : background_dn.rows;
  const auto at = [&](int line, int i) {
    return static_cast<double>(is_column ? background_dn.at<float>(i, line)
                                         : background_dn.at<float>(line, i));
  };
  const int beside = std::max(2, static_cast<int>(std::lround(kWidthsBeside * truth.width_px)));
  const int around = static_cast<int>(std::lround(kWidthsAround * truth.width_px));
  const int middle = static_cast<int>(std::lround(across(truth, axis)));
  const int line = static_cast<int>(std::lround(is_column ? truth.u_px : truth.v_px));
  double sum = 0.0;
  std::size_t count = 0;
  for (int l = std::max(0, line - kLinesAround); l <= std::min(lines - 1, line + kLinesAround);
       ++l) {
    const int last = std::min(length - 1 - beside, middle + around);
    for (int i = std::max(beside, middle - around); i <= last; ++i, ++count) {
      const double rise = at(l, i) - 0.5 * (at(l, i - beside) + at(l, i + beside));
      sum += rise * rise;
    }
  }
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

// What clips does not help to see the light. @param peak_dn of the pixel, with the light.
double snr(double light_dn, double peak_dn, const NoiseModel& noise, double more_dn2) {
  const double full_dn = (1 << noise.bit_depth.value_or(8)) - 1;
  const double seen_dn = light_dn - std::max(0.0, peak_dn - full_dn);
  return std::max(0.0, seen_dn) / std::sqrt(noise.variance_dn2(peak_dn) + more_dn2);
}

double snr(const TrueReturn& truth, const cv::Mat& expected_dn, const NoiseModel& noise,
           double more_dn2) {
  const int u = static_cast<int>(std::lround(truth.u_px));
  const int v = static_cast<int>(std::lround(truth.v_px));
  if (u < 0 || v < 0 || u >= expected_dn.cols || v >= expected_dn.rows) return 0.0;
  return snr(truth.amplitude_dn, expected_dn.at<float>(v, u), noise, more_dn2);
}

// Whether light there is a true return's own, which an edge of reflectance may have drawn aside.
bool is_of_a_true_return(const TrueLine& line, StripeAxis axis, double at) {
  bool is_own = false;
  for_each_true(line, [&](const TrueReturn& t) {
    is_own |= std::abs(across(t, axis) - at) <= kOwnWidths * t.width_px;
  });
  return is_own;
}

// How far a position of a scan line is from the nearest peak of the laser's light that is no true
// return's and stands out from the noise; NaN where there is none.
double error_from_light(const cv::Mat& expected_dn, const cv::Mat& background_dn,
                        const NoiseModel& noise, const Truth& truth, int line, double at) {
  const bool is_column = truth.axis == StripeAxis::kColumns;
  const int length = is_column ? expected_dn.rows : expected_dn.cols;
  const auto value = [&](const cv::Mat& image, int i) {
    return static_cast<double>(is_column ? image.at<float>(i, line) : image.at<float>(line, i));
  };
  const auto light = [&](int i) { return value(expected_dn, i) - value(background_dn, i); };
  double nearest = std::numeric_limits<double>::quiet_NaN();
  for (int i = 1; i + 1 < length; ++i) {
    const double before = light(i - 1);
    const double here = light(i);
    const double after = light(i + 1);
    if (!(here > before && here >= after)) continue;
    if (snr(here, value(expected_dn, i), noise, 0.0) < StripeScore::kSnr) continue;
    const double peak = i + 0.5 * (before - after) / (before - 2.0 * here + after);
    if (is_of_a_true_return(truth.lines[static_cast<std::size_t>(line)], truth.axis, peak))
      continue;
    if (!(std::abs(at - peak) >= std::abs(nearest))) nearest = at - peak;
  }
  return nearest;
}

bool is_neither(Judgement judgement) {
  return judgement == Judgement::kMixed || judgement == Judgement::kSide;
}

bool is_wrong(Judgement judgement) {
  return judgement == Judgement::kWrong || judgement == Judgement::kPhantom;
}

}  // namespace

JudgedPosition judge_position(const Truth& truth, int line, double across_px, double sigma_px) {
  const TrueLine& there = truth.lines[static_cast<std::size_t>(line)];
  JudgedPosition judged;
  judged.error_px = nearest_error(there, truth.axis, across_px);
  const bool has_stripe = there.status == TruthStatus::kVisible;
  if (is_right(judged.error_px, sigma_px)) {
    judged.judgement = Judgement::kRight;
  } else if (is_mixed(truth, line, across_px)) {
    judged.judgement = Judgement::kMixed;
  } else {
    judged.judgement = has_stripe ? Judgement::kWrong : Judgement::kPhantom;
  }
  return judged;
}

std::vector<JudgedReturn> judge(const PolarScan& scan, const Truth& truth,
                                const cv::Mat& expected_dn, const NoiseModel& noise,
                                const cv::Mat& background_dn) {
  std::vector<JudgedReturn> judged(scan.returns.size());
  for (std::size_t i = 0; i < judged.size(); ++i) {
    const TrueLine& line = truth.lines[i];
    JudgedReturn& r = judged[i];
    r.line = static_cast<int>(i);
    r.status = scan.returns[i].status;
    r.truth_status = line.status;
    if (line.status == TruthStatus::kVisible) {
      r.truth_amplitude = line.brightest.amplitude_dn;
      r.truth_snr = snr(line.brightest, expected_dn, noise, 0.0);
      r.truth_distinctness = background_dn.empty()
                                 ? r.truth_snr
                                 : snr(line.brightest, expected_dn, noise,
                                       texture_dn2(line.brightest, background_dn, scan.axis));
      for_each_true(line, [&](const TrueReturn& t) { r.near_edge |= t.near_edge; });
    }
    if (!r.has_values()) continue;
    r.confidence = scan.returns[i].confidence;
    r.across_px = scan.returns[i].across_px(scan.axis);
    r.sigma_px = scan.returns[i].row_sigma_px;
    JudgedPosition position = judge_position(truth, r.line, r.across_px, r.sigma_px);
    if (is_wrong(position.judgement) && !background_dn.empty()) {
      const double error_px =
          error_from_light(expected_dn, background_dn, noise, truth, r.line, r.across_px);
      if (is_right(error_px, r.sigma_px)) position.judgement = Judgement::kSide;
    }
    r.error_px = position.error_px;
    r.judgement = position.judgement;
  }
  return judged;
}

void StripeScore::add(const PolarScan& scan, const std::vector<JudgedReturn>& returns) {
  ++scans;
  unseen += scan.is_stripe_seen ? 0 : 1;
  for (const JudgedReturn& r : returns) {
    ++columns;
    const bool is_visible = r.truth_status == TruthStatus::kVisible;
    const bool is_clear = is_visible && r.truth_snr >= kSnr;
    const bool is_stripe = r.has_values() && r.judgement == Judgement::kRight;
    visible += is_visible ? 1 : 0;
    clear += is_clear ? 1 : 0;
    found += is_clear && r.is_ok() && is_stripe ? 1 : 0;
    found_visible += is_visible && r.is_ok() && is_stripe ? 1 : 0;
    const bool is_distinct = is_visible && r.truth_distinctness >= kSnr;
    distinct += is_distinct ? 1 : 0;
    found_distinct += is_distinct && r.is_ok() && is_stripe ? 1 : 0;
    if (r.is_ok()) {
      ++ok;
      mixed += r.judgement == Judgement::kMixed ? 1 : 0;
      phantom += r.judgement == Judgement::kPhantom ? 1 : 0;
      side += r.judgement == Judgement::kSide ? 1 : 0;
      wrong += is_wrong(r.judgement) ? 1 : 0;
      biased += r.judgement == Judgement::kWrong && std::abs(r.error_px) < kBiasedPx ? 1 : 0;
    }
    if (!r.has_values() || is_neither(r.judgement) || !std::isfinite(r.confidence)) {
      continue;
    }
    const auto above = std::upper_bound(kBins.begin(), kBins.end(), r.confidence);
    Bin& bin =
        bins[static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, above - kBins.begin()) - 1)];
    ++bin.count;
    bin.stripe += is_stripe ? 1 : 0;
    bin.sum += r.confidence;
    ++judged;
    const double miss = r.confidence - (is_stripe ? 1.0 : 0.0);
    squared += miss * miss;
  }
}

void StripeScore::add(const StripeScore& other) {
  scans += other.scans;
  unseen += other.unseen;
  columns += other.columns;
  visible += other.visible;
  clear += other.clear;
  found += other.found;
  found_visible += other.found_visible;
  distinct += other.distinct;
  found_distinct += other.found_distinct;
  ok += other.ok;
  wrong += other.wrong;
  phantom += other.phantom;
  biased += other.biased;
  mixed += other.mixed;
  side += other.side;
  judged += other.judged;
  squared += other.squared;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    bins[i].count += other.bins[i].count;
    bins[i].stripe += other.bins[i].stripe;
    bins[i].sum += other.bins[i].sum;
  }
}

}  // namespace striper::testing
