// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Dense>
#include <opencv2/core.hpp>

#include "stripe/profile/profile_kernel.hpp"

namespace striper::testing {

/// The oracle of `measure_profiles`: what its header says of one seed, in doubles, a pixel at a
/// time.
class PlainProfile {
 public:
  struct Images {
    cv::Mat lit, dark, masked, variance;  // Scan lines are columns.
    int full_scale_dn = 255;
  };

  /// The kernel takes as many steps of Gauss-Newton as the most impatient profile of a vector, so
  /// that a few of these may be its answer.
  struct Fit {
    double position = 0.0;  // From the centre.
    double amplitude = 0.0;
    double sigma = 0.0;  // Expected of such a profile, whatever noise made of this one.
  };

  double across = 0.0;   // Of the pixel that the filter peaks at,
  double peak_at = 0.0;  // and from the centre.
  double width = 0.0;
  double significance = 0.0;
  double clipped = 0.0;
  std::vector<Fit> fits;  // After 0, 1, 2, ... steps; of `fast` the first one only.

  PlainProfile(const Images& images, const detail::ProfilePlan& plan, detail::PeakSeed seed)
      : images_(images), plan_(plan), line_(seed.line) {
    move_to(seed.across);
    find_peak();
    across = centre_ + peak_at;
    find_clipped();
    expected_width_ =
        std::clamp(plan.width + plan.width_slope * across, static_cast<double>(plan.smallest_width),
                   static_cast<double>(plan.largest_width));
    set_noise();
    estimate();
    if (plan.refine) refine();
    set_width_and_significance();
  }

  double snr(const Fit& fit) const {
    return fit.amplitude / std::sqrt(variance(std::max(0.0, fit.amplitude)) + extra_of_pixel_);
  }
  // By the information that the profile itself has at its peak.
  double sigma(const Fit& fit) const {
    double variance = fit.sigma * fit.sigma;
    if (clipped > 0.0) return std::sqrt(variance + plan_.clipped_locking_variance);
    const double w2 = expected_width_ * expected_width_;
    variance /= std::clamp((w2 + filter2()) * curvature_, 0.5, 2.0);
    return std::sqrt(variance * (1.0 + variance / w2) + plan_.locking_variance);
  }
  double centre() const { return centre_; }

 private:
  // ---- Pixels, k from the centre. Outside of the image the border repeats, unseen.

  int length() const { return images_.lit.rows; }
  double pixel(const cv::Mat& image, int k) const {
    const int row = std::clamp(centre_ + k, 0, length() - 1);
    return image.depth() == CV_8U    ? image.at<std::uint8_t>(row, line_)
           : image.depth() == CV_16U ? image.at<std::uint16_t>(row, line_)
                                     : static_cast<double>(image.at<float>(row, line_));
  }
  double value(int k) const {
    return pixel(images_.lit, k) - (images_.dark.empty() ? 0.0 : pixel(images_.dark, k));
  }
  double seen(int k) const {
    const bool is_inside = centre_ + k >= 0 && centre_ + k < length();
    const bool is_masked = !images_.masked.empty() && pixel(images_.masked, k) != 0.0;
    return is_inside && !is_masked ? 1.0 : 0.0;
  }
  double usable(int k) const {
    return pixel(images_.lit, k) < images_.full_scale_dn ? seen(k) : 0.0;
  }
  double extra(int k) const { return images_.variance.empty() ? 0.0 : pixel(images_.variance, k); }
  double flat(int k) const { return seen(k) * (value(k) - level_ - slope_ * k); }
  double tap(int i) const {
    return std::abs(i) > plan_.taps ? 0.0 : plan_.filter[static_cast<std::size_t>(std::abs(i))];
  }

  template <typename Action>
  void for_ring(const Action& action) const {
    for (int q = plan_.core + 1; q <= plan_.window; ++q) {
      action(-q);
      action(q);
    }
  }

  // ---- Stages.

  void move_to(int across_pixel) {
    const int cell = 2 * plan_.aligned + 1;
    centre_ = std::min(across_pixel / cell * cell + plan_.aligned, length() - 1);
  }

  void fit_background() {
    best_extra_ = 1e12;
    for_ring([&](int k) {
      if (usable(k) > 0.0) best_extra_ = std::min(best_extra_, extra(k));
    });
    if (best_extra_ >= 1e12) best_extra_ = 0.0;
    double pixels = 0.0;
    double below = 0.0;
    double above = 0.0;
    double n = 0.0;
    double s1 = 0.0;
    double s2 = 0.0;
    double sf = 0.0;
    double s1f = 0.0;
    for_ring([&](int k) {
      const double floor = plan_.variance_floor;
      const double w = usable(k) * (floor + best_extra_) / (floor + extra(k));
      pixels += usable(k);
      (k < 0 ? below : above) += w;
      n += w;
      s1 += w * k;
      s2 += w * k * k;
      sf += w * value(k);
      s1f += w * k * value(k);
    });
    level_ = slope_ = level_variance_ = slope_variance_ = 0.0;
    if (pixels < 3.0) {
      level_variance_ = 1e12;
      return;
    }
    if (std::min(below, above) >= 3.0 || n >= 24.0) {
      const double det = n * s2 - s1 * s1;
      level_ = (s2 * sf - s1 * s1f) / det;
      slope_ = (n * s1f - s1 * sf) / det;
      level_variance_ = s2 / det;
      slope_variance_ = n / det;
    } else {
      level_ = sf / std::max(1.0, n);
      level_variance_ = 1.0 / std::max(1.0, n);
    }
  }

  double filtered(int at) const {
    double sum = 0.0;
    for (int i = -plan_.taps; i <= plan_.taps; ++i) sum += tap(i) * flat(at + i);
    return sum;
  }

  void find_peak() {
    for (int move = 0;; ++move) {
      fit_background();
      peak_ = -1e30;
      for (int k = -plan_.reach; k <= plan_.reach; ++k) {
        const double here = filtered(k);
        if (here <= peak_) continue;
        peak_ = here;
        peak_at = k;
      }
      if (move == 5 || std::abs(peak_at) <= plan_.stray) break;
      move_to(std::max(0, centre_ + static_cast<int>(peak_at)));
    }
    before_ = filtered(static_cast<int>(peak_at) - 1);
    after_ = filtered(static_cast<int>(peak_at) + 1);
  }

  // Of clipped pixels that lie side by side about the peak, both ends seen, the middle tells where
  // the stripe is.
  void find_clipped() {
    std::vector<int> pixels;
    const int reach = std::min(plan_.window, plan_.core + 2);
    for (int k = -reach; k <= reach; ++k) {
      is_cut_ = is_cut_ || seen(k) == 0.0;
      if (!(seen(k) > usable(k))) continue;
      pixels.push_back(k);
      if (std::abs(k) <= plan_.core) ++clipped;
    }
    if (pixels.empty() || is_cut_) return;
    const int first = pixels.front();
    const int last = pixels.back();
    const bool is_run = last - first + 1 == static_cast<int>(pixels.size());
    const bool has_ends = first > -reach && last < reach;
    const bool has_peak = peak_at >= first - 1.5 && peak_at <= last + 1.5;
    if (is_run && has_ends && has_peak) run_middle_ = 0.5 * (first + last);
  }
  double run_variance() const { return 1.0 / 24.0 + 0.09 * expected_width_ * expected_width_; }

  void set_noise() {
    dark_ = 0.0;
    for (int k = -plan_.window; k <= plan_.window && !images_.dark.empty(); ++k) {
      dark_ += pixel(images_.dark, k) / (2 * plan_.window + 1);
    }
    base_ = plan_.variance_floor +
            plan_.variance_per_dn * std::max(0.0, level_ + dark_ - plan_.black_dn);
    if (!images_.dark.empty()) {
      base_ +=
          plan_.dark_noise_gain *
          (plan_.variance_floor + plan_.variance_per_dn * std::max(0.0, dark_ - plan_.black_dn));
      base_ += excess_shot_noise();
    }
    double deviations = 0.0;
    for (int i = -plan_.taps; i <= plan_.taps; ++i) {
      const double deviation = tap(i) * std::sqrt(extra(static_cast<int>(peak_at) + i));
      extra_of_pixel_ += deviation * deviation / plan_.filter_energy;
      deviations += deviation;
    }
    extra_of_response_ = deviations * deviations;
  }

  // Of what the dark image has at the peak, in weights of noise, above its mean and one sigma of
  // such a sum.
  double excess_shot_noise() const {
    double under = 0.0;
    double squares = 0.0;
    for (int i = -plan_.noise_reach; i <= plan_.noise_reach; ++i) {
      const double weight = plan_.noise_weight[static_cast<std::size_t>(std::abs(i))];
      under += weight * pixel(images_.dark, static_cast<int>(peak_at) + i);
      squares += weight * weight;
    }
    const double of_mean =
        plan_.variance_floor + plan_.variance_per_dn * std::max(0.0, dark_ - plan_.black_dn);
    const double brighter = std::max(0.0, under - dark_ - std::sqrt(squares * of_mean));
    return (1.0 + plan_.dark_noise_gain) * plan_.variance_per_dn * brighter;
  }

  double variance(double signal) const {
    return base_ + signal * (plan_.variance_per_dn + plan_.speckle2 * signal);
  }

  void estimate() {
    const auto log_of = [&](double side) {
      return std::log(std::clamp(side / std::max(peak_, 1e-3), 1e-3, 1.0));
    };
    const double a = log_of(before_);
    const double c = log_of(after_);
    curvature_ = std::max(-a - c, 1e-4);
    double offset = std::clamp((c - a) / (2.0 * curvature_), -0.5, 0.5);
    if (plan_.has_filter_locking) {
      const double square = offset * offset;
      offset -= offset * (1.0 - 4.0 * square) *
                (plan_.filter_locking[0] + plan_.filter_locking[1] * square);
    }
    const double total = expected_width_ * expected_width_ + filter2();
    const double gain = expected_width_ * plan_.filter_sigma * std::sqrt(2.0 * kPi / total);
    Fit fit;
    fit.position = peak_at + offset;
    fit.amplitude = peak_ * std::exp(0.5 * offset * offset / total) / gain;
    fit.sigma = filter_sigma(fit.amplitude);
    fits.push_back(fit);
  }

  double filter_sigma(double amplitude) const {
    const double a = std::max(amplitude, 1e-3);
    const double w = expected_width_;
    const double base = base_ + extra_of_pixel_;
    const double white = plan_.filter_white * w * base;
    const double shot = plan_.filter_shot * w * plan_.variance_per_dn * a;
    const double speckle = plan_.filter_speckle * w * plan_.speckle2 * a * a;
    const double slope = plan_.filter_slope * std::pow(w, 4.0) * slope_variance_ * base;
    return std::sqrt(white + shot + speckle + slope) / a;
  }

  double filter2() const { return static_cast<double>(plan_.filter_sigma) * plan_.filter_sigma; }

  double ceiling_dn() const {
    const double room = images_.full_scale_dn - level_ - dark_;
    return room - std::sqrt(std::max(variance(room), base_));
  }

  void refine() {
    if (run_middle_) {
      fits.front().position = *run_middle_;
      fits.front().sigma = std::sqrt(run_variance());
    }
    const Fit start = fits.front();
    Fit fit = start;
    double limit = std::numeric_limits<double>::infinity();
    const double ceiling = ceiling_dn();
    for (int step = 1; step <= 6; ++step) {
      take_step(limit, fit);
      fits.push_back(fit);
      if (clipped > 0.0) limit = ceiling;
    }
    for (Fit& f : fits) {
      const double allowed = 0.5 * clipped + 1.2 * expected_width_;
      const bool is_anywhere = clipped == 0.0 && !(f.sigma <= allowed);
      if (is_anywhere || std::abs(f.position - start.position) > allowed) f = start;
      if (is_cut_) f.sigma = std::hypot(f.sigma, moved_by_width(limit, f));
    }
  }

  struct Equations {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    Eigen::Vector4d wider = Eigen::Vector4d::Zero();  // Of a wider stripe, over its amplitude.
  };

  Equations equations(double limit, const Fit& fit) const {
    Equations e;
    const double w = expected_width_;
    const double cumulant = -1.0 / (2880.0 * std::pow(w, 4.0));
    for (int k = -plan_.window; k <= plan_.window; ++k) {
      const bool is_core = std::abs(k) <= plan_.core;
      const double t = (k - fit.position) / w;
      const double g = std::exp(-0.5 * t * t);
      const double value =
          is_core ? g * (1.0 + cumulant * (std::pow(t, 4) - 6.0 * t * t + 3.0)) : 0.0;
      const double derivative =
          is_core ? g * t / w * (1.0 + cumulant * (std::pow(t, 4) - 10.0 * t * t + 15.0)) : 0.0;
      const double signal = std::max(0.0, fit.amplitude * value);
      if (is_core && signal > limit) continue;
      const double weight = usable(k) / (variance(signal) + extra(k));
      const Eigen::Vector4d gradient(1.0, k, value, derivative);
      e.normal += weight * gradient * gradient.transpose();
      e.right += weight * flat(k) * gradient;
      if (is_core) e.wider += weight * g * t * t * gradient;
    }
    return e;
  }

  // Where the profile is cut.
  double moved_by_width(double limit, const Fit& fit) const {
    const Equations e = equations(limit, fit);
    return std::min(std::abs(0.08 * (e.normal.inverse() * e.wider)[3]), expected_width_);
  }

  void take_step(double limit, Fit& fit) const {
    const Equations e = equations(limit, fit);
    const Eigen::Matrix4d covariance = e.normal.inverse();
    const Eigen::Vector4d solution = covariance * e.right;
    fit.amplitude = std::max(solution[2], 1e-3);
    if (run_middle_) fit.amplitude = std::min(fit.amplitude, 64.0 * ceiling_dn());
    double wanted = solution[3] / fit.amplitude;
    double variance = covariance(3, 3) / (fit.amplitude * fit.amplitude);
    if (run_middle_) {  // One more measurement of the position.
      const double part = run_variance() / (run_variance() + variance);
      wanted = part * wanted + (1.0 - part) * (*run_middle_ - fit.position);
      variance *= part;
    }
    const double longest = 0.75 * expected_width_;
    fit.position += std::clamp(wanted, -longest, longest);
    fit.sigma = std::sqrt(variance);
  }

  void set_width_and_significance() {
    const double sides = before_ * after_ - base_ * plan_.filter_covariance;
    const double centre = std::max(1e-6, peak_ * peak_ - base_ * plan_.filter_energy);
    const double curvature = -std::log(std::max(1e-6, sides / centre));
    width = std::sqrt(std::max(0.04, 1.0 / std::max(1e-4, curvature) - filter2()));
    if (clipped > 0.0) width = expected_width_;
    const double sum2 = static_cast<double>(plan_.filter_sum) * plan_.filter_sum;
    significance = peak_ / std::sqrt(base_ * plan_.filter_energy + extra_of_response_ +
                                     sum2 * level_variance_ * (base_ + best_extra_));
  }

  static constexpr double kPi = 3.14159265358979323846;

  const Images& images_;
  const detail::ProfilePlan& plan_;
  int line_;
  int centre_ = 0;
  double level_ = 0.0, slope_ = 0.0, level_variance_ = 0.0, slope_variance_ = 0.0;
  double best_extra_ = 0.0;
  double before_ = 0.0, peak_ = 0.0, after_ = 0.0;
  double dark_ = 0.0, base_ = 0.0, extra_of_pixel_ = 0.0, extra_of_response_ = 0.0;
  double expected_width_ = 0.0;
  std::optional<double> run_middle_;
  bool is_cut_ = false;  // By the image's border or a mask.
  double curvature_ = 0.0;
};

}  // namespace striper::testing
