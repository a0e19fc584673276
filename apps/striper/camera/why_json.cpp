// SPDX-License-Identifier: Apache-2.0
#include "camera/why_json.hpp"

#include <cmath>

#include <nlohmann/json.hpp>

namespace striper::program {
namespace {

nlohmann::json number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

nlohmann::json to_json(const LineCandidate& c) {
  return {{"across_px", number(c.across_px)},
          {"sigma_px", number(c.sigma_px)},
          {"amplitude_dn", number(c.amplitude_dn)},
          {"width_px", number(c.width_px)},
          {"significance", number(c.significance)},
          {"snr", number(c.snr)},
          {"probability", number(c.probability)},
          {"lines", c.lines},
          {"support", c.support},
          {"fate", to_string(c.fate)}};
}

nlohmann::json to_json(const SigmaCauses& sigma) {
  return {{"read", number(sigma.read)},       {"shot", number(sigma.shot)},
          {"speckle", number(sigma.speckle)}, {"locking", number(sigma.locking)},
          {"other", number(sigma.other)},     {"total", number(sigma.total)}};
}

}  // namespace

nlohmann::json to_json(std::uint64_t frame, const ScanExplanation& why) {
  const LineExplanation& line = why.line;
  const Return& result = why.result;
  nlohmann::json candidates = nlohmann::json::array();
  for (const LineCandidate& c : line.candidates) candidates.push_back(to_json(c));
  return {{"frame", frame},
          {"line", line.line},
          {"status", to_string(result.status)},
          {"range_m", number(result.range_m)},
          {"sigma_m", number(result.sigma_m)},
          {"sigma_cal_m", number(result.sigma_cal_m)},
          {"u_px", number(result.u_px)},
          {"v_px", number(result.v_px)},
          {"confidence", number(static_cast<double>(result.confidence))},
          {"range_m_per_px", number(why.range_m_per_px)},
          {"range_m_per_deg", number(why.range_m_per_deg)},
          {"noise_dn", number(line.noise_dn)},
          {"least_significance", number(line.least_significance)},
          {"expected_width_px", number(line.expected_width_px)},
          {"from_px", number(line.from_px)},
          {"to_px", number(line.to_px)},
          {"chosen_over_lines", line.is_chosen_over_lines},
          {"bridged", line.is_bridged},
          {"candidates", candidates},
          {"sigma_px", to_json(line.sigma_px)},
          {"first_px", line.first_px},
          {"step_px", line.step_px},
          {"lit_dn", line.lit},
          {"dark_dn", line.dark}};
}

}  // namespace striper::program
