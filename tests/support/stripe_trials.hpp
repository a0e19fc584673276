// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include <striper/core/lit_frame.hpp>
#include <striper/stripe/crlb.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/random.hpp"

namespace striper::testing {

/// One point of a Monte Carlo grid: an image whose columns are independent trials, the stripe at a
/// random phase of the pixel in each. SNR is amplitude over the noise at the peak pixel.
struct StripeTrials {
  enum class Noise { kWhite, kShot, kEightBitsBright, kEightBitsDim };

  int trials = 4000;
  double sigma_px = 1.5;
  double snr = 20.0;
  Noise noise = Noise::kWhite;
  double ramp = 0.0;        ///< Background slope, amplitudes per pixel.
  double saturation = 0.0;  ///< Amplitude as a multiple of full scale; 0: well inside.
  double tilt = 0.0;        ///< Pixels that the stripe climbs per column: the profile is smeared.
  double albedo = 1.0;      ///< Reflectance above the stripe's centre over that below.
};

struct RenderedTrials {
  LitFrame frame;
  std::vector<double> truth;
  NoiseModel noise;
  double bound_px = 0.0;                   ///< Cramer-Rao, root mean square over the phase.
  std::optional<double> known_sigma_px{};  ///< The extractor is told how wide the stripe is.
};

inline constexpr int kTrialRows = 128;
inline constexpr int kTrialCentre = 64;
/// Between the background and black, and between the stripe and white, in standard deviations of
/// the noise: noise that is cut off is another noise.
inline constexpr double kRoom = 4.0;

inline double trial_value(const StripeTrials& t, const StripeProfile& profile, int row) {
  if (t.tilt == 0.0 && t.albedo == 1.0) return profile.value_dn(row);
  double value = profile.background_dn;
  constexpr int kParts = 9;
  for (int n = 0; n < kParts; ++n) {
    StripeProfile part = profile;
    part.background_dn = 0.0;
    part.position_px += t.tilt * ((n + 0.5) / kParts - 0.5);
    if (t.albedo == 1.0) {
      value += part.value_dn(row) / kParts;
      continue;
    }
    // Reflectance changes at the centre of the stripe: sub-pixels, each with its own.
    constexpr int kFine = 16;
    for (int i = 0; i < kFine; ++i) {
      const double y = row - 0.5 + (i + 0.5) / kFine;
      const double x = (y - part.position_px) / part.sigma_px;
      const double reflectance = y < part.position_px ? 1.0 : t.albedo;
      value += reflectance * part.amplitude_dn * std::exp(-0.5 * x * x) / (kFine * kParts);
    }
  }
  return value;
}

inline RenderedTrials render(const StripeTrials& t) {
  const bool eight = t.noise == StripeTrials::Noise::kEightBitsBright ||
                     t.noise == StripeTrials::Noise::kEightBitsDim;
  RenderedTrials out;
  out.frame.full_scale_dn = eight ? 255 : 65535;
  const double full = out.frame.full_scale_dn;
  StripeProfile profile{0.0, 0.3 * full, t.sigma_px, 0.02 * full, 0.0};
  if (t.noise == StripeTrials::Noise::kEightBitsBright) {
    profile.amplitude_dn = std::min(200.0, full / (1.0 + 2.0 * kRoom / t.snr));
  }
  if (t.noise == StripeTrials::Noise::kEightBitsDim) profile.amplitude_dn = 20.0;
  if (t.saturation > 0.0) profile.amplitude_dn = t.saturation * full;
  if (t.ramp != 0.0) profile.background_dn += 70.0 * t.ramp * profile.amplitude_dn;

  const double scale = t.saturation > 0.0 ? full : profile.amplitude_dn;
  const double sigma_dn = scale / t.snr;
  profile.background_dn = std::max(profile.background_dn, kRoom * sigma_dn);
  const double peak = StripeProfile{0.0, profile.amplitude_dn, t.sigma_px, 0.0, 0.0}.value_dn(0);
  out.noise.black_level_dn = profile.background_dn;
  const double shot = t.noise == StripeTrials::Noise::kShot ? 0.9 : 0.0;
  out.noise.dn_per_electron = shot * sigma_dn * sigma_dn / peak;
  out.noise.read_noise_dn = std::sqrt(1.0 - shot) * sigma_dn;  // Quantisation comes on top.

  out.frame.lit = cv::Mat(kTrialRows, t.trials, eight ? CV_8UC1 : CV_16UC1);
  for (int c = 0; c < t.trials; ++c) {
    profile.position_px = kTrialCentre + uniform(-0.5, 0.5);
    out.truth.push_back(profile.position_px);
    for (int r = 0; r < kTrialRows; ++r) {
      const double ramp = t.ramp * profile.amplitude_dn * (r - kTrialCentre);
      const double clean = trial_value(t, profile, r) + ramp;
      const double light = std::max(0.0, clean - profile.background_dn - ramp);
      const double variance =
          out.noise.read_noise_dn * out.noise.read_noise_dn + out.noise.dn_per_electron * light;
      const double dn = std::clamp(std::round(normal(clean, std::sqrt(variance))), 0.0, full);
      if (eight) {
        out.frame.lit.at<std::uint8_t>(r, c) = static_cast<std::uint8_t>(dn);
      } else {
        out.frame.lit.at<std::uint16_t>(r, c) = static_cast<std::uint16_t>(dn);
      }
    }
  }

  CrlbOptions options;
  options.noise = out.noise;
  const int half = static_cast<int>(std::ceil(7.0 * t.sigma_px)) + 6;
  options.first_pixel = kTrialCentre - half;
  options.last_pixel = kTrialCentre + half;
  options.full_scale_dn = t.saturation > 0.0 ? full : 0.0;
  options.slope_is_known = t.ramp == 0.0;
  double sum = 0.0;
  constexpr int kPhases = 16;
  for (int n = 0; n < kPhases; ++n) {
    profile.position_px = kTrialCentre + (n + 0.5) / kPhases - 0.5;
    sum += std::pow(crlb_sigma_px(profile, options), 2.0) / kPhases;
  }
  out.bound_px = std::sqrt(sum);
  return out;
}

/// What an estimator made of the trials.
struct TrialScore {
  double bias_px = 0.0;
  double rms_px = 0.0;
  double rms_over_bound = 0.0;
  double pull_sigma = 0.0;  ///< Robust: half of the 68.27 % interval. 0 without sigmas.
  double beyond_3_sigma = 0.0;
  double locking_px = 0.0;  ///< Peak to peak of the mean error over 16 phases of the pixel.
  int missing = 0;
  int doubtful = 0;
};

inline TrialScore score(const RenderedTrials& trials, const std::vector<double>& positions,
                        const std::vector<double>& sigmas) {
  TrialScore s;
  constexpr int kPhases = 16;
  std::vector<double> sums(kPhases, 0.0);
  std::vector<double> counts(kPhases, 0.0);
  std::vector<double> pulls;
  int n = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!std::isfinite(positions[i])) {
      ++s.missing;
      continue;
    }
    const double d = positions[i] - trials.truth[i];
    ++n;
    s.bias_px += d;
    s.rms_px += d * d;
    const double phase = trials.truth[i] - kTrialCentre + 0.5;
    const auto bin = static_cast<std::size_t>(std::clamp(phase * kPhases, 0.0, kPhases - 1.0));
    sums[bin] += d;
    counts[bin] += 1.0;
    if (!sigmas.empty()) pulls.push_back(std::abs(d) / sigmas[i]);
  }
  if (n == 0) return s;
  s.bias_px /= n;
  s.rms_px = std::sqrt(s.rms_px / n);
  s.rms_over_bound = s.rms_px / trials.bound_px;
  double low = 1e9;
  double high = -1e9;
  for (std::size_t bin = 0; bin < sums.size(); ++bin) {
    low = std::min(low, sums[bin] / counts[bin]);
    high = std::max(high, sums[bin] / counts[bin]);
  }
  s.locking_px = high - low;
  if (!pulls.empty()) {
    std::sort(pulls.begin(), pulls.end());
    s.pull_sigma = pulls[static_cast<std::size_t>(0.6827 * static_cast<double>(pulls.size()))];
    const auto beyond = pulls.end() - std::upper_bound(pulls.begin(), pulls.end(), 3.0);
    s.beyond_3_sigma = static_cast<double>(beyond) / static_cast<double>(pulls.size());
  }
  return s;
}

/// What an extraction method makes of them, given the camera's noise as a calibrated one is. The
/// columns are no surface, so the scatter along the stripe is not to be learnt from.
inline Stripe extract(const RenderedTrials& trials, ExtractMethod method) {
  ExtractOptions options;
  options.method = method;
  options.noise = trials.noise;
  options.excess_sigma_px = 0.0;
  options.each_line_by_itself = true;
  options.stripe_sigma_px = trials.known_sigma_px;
  Stripe stripe;
  make_extractor(options)->extract(trials.frame, stripe);
  return stripe;
}

inline TrialScore score(const RenderedTrials& trials, ExtractMethod method) {
  const Stripe stripe = extract(trials, method);
  const std::vector<double> sigmas(stripe.sigma_px.begin(), stripe.sigma_px.end());
  TrialScore s = score(trials, stripe.across_px, sigmas);
  for (const ReturnStatus status : stripe.status) {
    s.doubtful += verdict(status) == Verdict::kDoubtful ? 1 : 0;
  }
  return s;
}

}  // namespace striper::testing
