// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <striper/core/frame.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/pipeline/stripe_survey.hpp>

#include "options/scanner_arguments.hpp"

namespace striper::program {

/// Where a stripe is seen that was looked for elsewhere; empty where none is. Ways that show it in
/// a few scan lines only do not count: so much any scene has.
std::optional<StripeSighting> best_sighting(std::span<const Frame> frames,
                                            const ScannerOptions& options);

/// "a stripe along rows in channel red is seen in 93 % of the rows".
std::string describe(const StripeSighting& sighting);

/// "--axis rows --channel red": what to say to get there; empty where it is what was tried.
std::string options_for(const StripeSighting& sighting, const ScannerOptions& tried);

/// Keeps the first frames of a stream, with pixels of their own, for a second look.
class KeptFrames {
 public:
  void keep(const Frame& frame);
  void forget() { frames_.clear(); }
  std::span<const Frame> frames() const noexcept { return frames_; }

 private:
  std::vector<Frame> frames_;
};

/// Watches a stream's scans and says, with the word `no_stripe`, that they show no stripe, what was
/// tried, and where there is one instead.
class StripeWatch {
 public:
  /// Says where the stripe is looked for.
  StripeWatch(const ScannerArguments& arguments, const ScannerSetup& setup);

  /// A frame, before it is scanned.
  void keep(const Frame& frame);

  /// What came of it. Speaks up once, when the first scans are all without a stripe.
  void look_at(ScanSpan scans);

  /// At the end: says how many scans were without a stripe, if any.
  void conclude();

  /// Adds `without_stripe` and `stripe_elsewhere` (null, or axis, channel and found).
  void add_to(nlohmann::json& summary) const;

 private:
  void say_where_it_is();

  ScannerOptions options_;
  std::string search_;
  KeptFrames kept_;
  std::uint64_t scans_ = 0;
  std::uint64_t without_stripe_ = 0;
  bool has_spoken_ = false;
  std::optional<StripeSighting> elsewhere_;
};

}  // namespace striper::program
