// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/channel.hpp>
#include <striper/core/frame.hpp>
#include <striper/model/striper_model.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/truth.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/stripe_score.hpp"

namespace striper::testing {

/// A scanner before a random scene, one laser always on, with the model that a perfect calibration
/// would give.
struct ChoiceTrial {
  /// `rooms`, `bare rooms`, `off` (rooms without the laser), `sessions`, `off sessions`, or a file.
  std::string kind = "rooms";
  std::uint64_t seed = 1;
  int frames = 0;  ///< 0: 3, or as many as a session has.
  PeakRule peak = ExtractOptions{}.peak;
  bool knows_stripe = true;  ///< The model says what the stripe looks like.
  /// `grey`; `red` or `green`: a colour camera and such a laser; `mixed`: by the seed.
  std::string colour = "grey";
  bool is_overexposed = false;
  bool is_shaded = false;  ///< Something before the laser keeps it from a few blocks of columns.
  bool is_compressed = false;        ///< By JPEG, as cameras on USB do; 8 bits alone.
  std::optional<Channel> channel{};  ///< Instead of the laser's own.
};

struct ChoiceScore {
  StripeScore first;  ///< Of the first frame alone.
  StripeScore all;
};

/// Called with each frame's number and its judged returns.
using JudgedFrame = std::function<void(int frame, const std::vector<JudgedReturn>& returns)>;

/// What a trial's scanner looks at.
class TrialCamera {
 public:
  explicit TrialCamera(const ChoiceTrial& trial);
  ~TrialCamera();
  TrialCamera(const TrialCamera&) = delete;
  TrialCamera& operator=(const TrialCamera&) = delete;

  int frames() const;
  StriperModel model() const;  ///< As a calibration would find it.
  ScannerOptions options() const;
  Frame render(std::uint64_t number);
  cv::Mat expected_dn(std::uint64_t number);    ///< Without noise.
  cv::Mat background_dn(std::uint64_t number);  ///< And without the laser; empty: a colour camera.
  Truth truth(std::uint64_t number);            ///< Laser off: nothing is to be found.

 private:
  struct Parts;
  void shade(const cv::Mat& unlit, cv::Mat& image) const;

  std::unique_ptr<Parts> parts_;
  std::unique_ptr<Parts> unlit_;   // Of shaded trials.
  std::vector<cv::Range> shaded_;  // Columns.
};

/// Runs a trial: 0.3 to 3 s. Thread-safe.
ChoiceScore run_trial(const ChoiceTrial& trial, const JudgedFrame& visit = {});

}  // namespace striper::testing
