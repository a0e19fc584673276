// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/noise_model.hpp>
#include <striper/scan/polar_scan.hpp>
#include <striper/simulator/truth.hpp>

namespace striper::testing {

/// What a return is, by the truth.
enum class Judgement {
  kRight,    ///< Within max(0.5 px, 3 sigma) of a true return of its scan line.
  kMixed,    ///< At an edge, between the two stripes that meet there and within 4 px of one.
  kWrong,    ///< Something else in a scan line that shows a stripe.
  kPhantom,  ///< In a scan line without a stripe.
  kSide,     ///< On light of the laser plane's side, where the middle of the plane is shaded.
};

/// One return with what is known of its scan line.
struct JudgedReturn {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  int line = 0;
  ReturnStatus status = ReturnStatus::kNoStripe;
  double confidence = kNone;
  double across_px = kNone;
  double sigma_px = kNone;
  double error_px = kNone;         ///< From the nearest true return of the scan line.
  double truth_amplitude = kNone;  ///< DN, of the brightest true return.
  double truth_snr = kNone;  ///< That, as far as it does not clip, over its peak pixel's noise,
  /// and over that and what the background shows of a stripe's width around it, together.
  double truth_distinctness = kNone;
  TruthStatus truth_status = TruthStatus::kNoSurface;
  bool near_edge = false;
  Judgement judgement = Judgement::kPhantom;  ///< Only where the return has values.

  bool has_values() const { return verdict(status) != Verdict::kMissing; }
  bool is_ok() const { return status == ReturnStatus::kOk; }
};

/// Judges a scan line by line. Truth knows where the middle of the laser plane is lit. What would
/// be wrong is kSide within max(0.5 px, 3 sigma) of a peak of the laser's light that is 8 times the
/// noise and farther than 4 widths from true returns.
/// @param truth may have no stripe at all (laser off).
/// @param expected_dn the exposure without noise, for the noise of a peak pixel: the whole sensor.
/// @param background_dn the same with the laser off; empty (of a colour camera): without texture,
/// and nothing is kSide.
std::vector<JudgedReturn> judge(const PolarScan& scan, const Truth& truth,
                                const cv::Mat& expected_dn, const NoiseModel& noise,
                                const cv::Mat& background_dn = {});

/// What a position in a scan line is. @param error_px from the nearest true return, as `judge`
/// gives it.
struct JudgedPosition {
  Judgement judgement = Judgement::kPhantom;
  double error_px = JudgedReturn::kNone;
};
JudgedPosition judge_position(const Truth& truth, int line, double across_px, double sigma_px);

/// Shares and a reliability diagram, summed over scans.
struct StripeScore {
  static constexpr double kSnr = 8.0;
  static constexpr double kBiasedPx = 2.0;
  static constexpr std::array<double, 7> kBins = {0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 0.999};

  struct Bin {
    std::size_t count = 0;
    std::size_t stripe = 0;
    double sum = 0.0;  ///< Of the confidences.
  };

  std::size_t scans = 0;
  std::size_t unseen = 0;  ///< Scans with `is_stripe_seen` false.
  std::size_t columns = 0;
  std::size_t visible = 0;  ///< Columns with a stripe, however weak.
  std::size_t clear = 0;    ///< Of them, with an SNR of kSnr and more.
  std::size_t found = 0;    ///< Of the clear ones, `ok` and right.
  std::size_t found_visible = 0;
  std::size_t distinct = 0;        ///< Columns with a distinctness of kSnr and more.
  std::size_t found_distinct = 0;  ///< Of them, `ok` and right.
  std::size_t ok = 0;
  std::size_t wrong = 0;    ///< `ok`: kWrong and kPhantom.
  std::size_t phantom = 0;  ///< `ok` in columns without a stripe.
  std::size_t biased = 0;   ///< `ok`, wrong by less than kBiasedPx: the stripe, badly placed.
  std::size_t mixed = 0;    ///< `ok`.
  std::size_t side = 0;     ///< `ok`.
  std::array<Bin, kBins.size()> bins = {};
  std::size_t judged = 0;
  double squared = 0.0;  ///< Sum of (confidence - 1 if it is the stripe else 0)^2.

  void add(const PolarScan& scan, const std::vector<JudgedReturn>& returns);
  void add(const StripeScore& other);

  double found_percent() const { return percent(found, clear); }
  double found_distinct_percent() const { return percent(found_distinct, distinct); }
  double wrong_percent() const { return percent(wrong, columns); }
  double phantom_percent() const { return percent(phantom, columns); }
  double brier() const { return judged == 0 ? 0.0 : squared / static_cast<double>(judged); }

  static double percent(std::size_t part, std::size_t whole) {
    return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
  }
};

}  // namespace striper::testing
