// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stripe/extractor.hpp>

#include "stripe/paper_extractor.hpp"
#include "stripe/profile_extractor.hpp"

namespace striper {
namespace {

void check_positive(const std::optional<double>& value, std::string_view field,
                    std::string_view expected) {
  if (value) require_value(*value > 0.0 && std::isfinite(*value), field, *value, expected);
}

}  // namespace

void ExtractOptions::validate() const {
  check_positive(threshold_dn, "threshold_dn", "a number of DN above 0");
  check_positive(stripe_sigma_px, "stripe_sigma_px", "a number of pixels above 0");
  require_value(false_alarm_rate > 0.0 && false_alarm_rate < 1.0, "false_alarm_rate",
                false_alarm_rate, "a rate between 0 and 1");
  require_value(weak_false_alarm_rate > 0.0 && weak_false_alarm_rate <= false_alarm_rate,
                "weak_false_alarm_rate", weak_false_alarm_rate,
                "above 0 and at most false_alarm_rate");
  require_value(min_snr >= 0.0, "min_snr", min_snr, "0 or more");
  require_value(min_width_ratio >= 0.0 && min_width_ratio < 1.0, "min_width_ratio", min_width_ratio,
                "at least 0 and below 1");
  require_value(max_width_ratio > 1.0, "max_width_ratio", max_width_ratio, "above 1");
  require_value(ambiguity_ratio > 0.0, "ambiguity_ratio", ambiguity_ratio, "above 0");
  require_value(min_confidence >= 0.0 && min_confidence <= 1.0, "min_confidence", min_confidence,
                "a probability");
  require_value(max_saturated_sigma_px > 0.0, "max_saturated_sigma_px", max_saturated_sigma_px,
                "above 0");
  require_value(speckle_contrast >= 0.0, "speckle_contrast", speckle_contrast, "0 or more");
  if (excess_sigma_px) {
    require_value(*excess_sigma_px >= 0.0, "excess_sigma_px", *excess_sigma_px, "0 or more");
  }
}

LineExplanation StripeExtractor::explain(int /*line*/) const {
  throw Error(ErrorKind::kUnsupported,
              "explain: method paper has no candidates to explain; use fast or refined");
}

std::unique_ptr<StripeExtractor> make_extractor(const ExtractOptions& options) {
  options.validate();
  if (options.method == ExtractMethod::kPaper) {
    return std::make_unique<detail::PaperExtractor>(options);
  }
  return std::make_unique<detail::ProfileExtractor>(options);
}

}  // namespace striper
