// SPDX-License-Identifier: Apache-2.0
#include "measure/known_target.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace striper::program {
namespace {

constexpr double kMostSigmas = 3.0;

std::string why(MeasureStatus status) {
  switch (status) {
    case MeasureStatus::kOk:
      return "found";
    case MeasureStatus::kNoLine:
      return "not of that shape";
    case MeasureStatus::kFewPoints:
      return "fewer surfaces, or returns on them, than it takes";
    case MeasureStatus::kAmbiguous:
      return "no shape that tells it, or several surfaces that it may be";
    case MeasureStatus::kOutside:
      return "its end is not in view";
  }
  return {};
}

}  // namespace

KnownTarget::KnownTarget(Kind kind, double known_m, std::shared_ptr<const StriperModel> model)
    : kind_(kind),
      known_m_(known_m),
      measurer_({parse_measure_tool(kind == Kind::kStep ? "target:step" : "target:circle")},
                std::move(model)) {}

void KnownTarget::add(const PolarScan& scan) {
  const Measurement& m = measurer_.measure(scan)[0];
  ++scans_;
  ++status_[m.status];
  if (m.status != MeasureStatus::kOk) return;
  sum_m_ += std::abs(m.value);
  variance_m2_ += m.sigma * m.sigma;
  sigma_cal_m_ = std::isfinite(m.sigma_cal) ? m.sigma_cal : 0.0;
}

int KnownTarget::count() const {
  const auto found = status_.find(MeasureStatus::kOk);
  return found == status_.end() ? 0 : found->second;
}

double KnownTarget::mean_m() const { return sum_m_ / count(); }

double KnownTarget::sigma_m() const {
  return std::hypot(std::sqrt(variance_m2_) / count(), sigma_cal_m_);
}

std::vector<std::string> KnownTarget::failures() const {
  std::vector<std::string> failures;
  if (2 * count() <= scans_) {
    std::vector<std::string> reasons;
    for (const auto& [status, scans] : status_)
      if (status != MeasureStatus::kOk)
        reasons.push_back(fmt::format("{}: {}", scans, why(status)));
    failures.push_back(fmt::format("the {} is found in {} of {} scans ({})", name(), count(),
                                   scans_, fmt::join(reasons, ", ")));
  }
  if (count() > 0 && std::abs(mean_m() - known_m_) > kMostSigmas * sigma_m())
    failures.push_back(
        fmt::format("the {}'s error of {:+.3f} mm is beyond three sigmas of {:.3f} mm", name(),
                    1e3 * (mean_m() - known_m_), 1e3 * sigma_m()));
  return failures;
}

std::string KnownTarget::line() const {
  if (count() == 0) return fmt::format("{}: not found", name());
  return fmt::format(
      "{}: {:.3f} mm measured, {:.3f} mm known, error {:+.3f} +- {:.3f} mm (k = 2; {} of {} scans)",
      name(), 1e3 * mean_m(), 1e3 * known_m_, 1e3 * (mean_m() - known_m_), 2e3 * sigma_m(), count(),
      scans_);
}

nlohmann::json KnownTarget::to_json() const {
  nlohmann::json json{{"known_m", known_m_}, {"measured_m", nullptr}, {"count", count()}};
  for (const auto& [status, scans] : status_)
    json["status"][std::string(to_string(status))] = scans;
  if (count() == 0) return json;
  json["measured_m"] = mean_m();
  json["error_m"] = mean_m() - known_m_;
  json["sigma_m"] = sigma_m();
  return json;
}

}  // namespace striper::program
