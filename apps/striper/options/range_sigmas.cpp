// SPDX-License-Identifier: Apache-2.0
#include "options/range_sigmas.hpp"

#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>

#include "options/option_bounds.hpp"

namespace striper::program {

CommandOption* add_sigma_option(Command& command, double& sigma_m) {
  return command.add_option("--sigma", sigma_m, "Error of ranges that come without one, metres")
      ->type_name("M")
      ->check(between(1e-6, 1.0));
}

void RangeSigmas::complete(PolarScan& scan) {
  bool is_any = false;
  bool is_known = false;
  for (Return& r : scan.returns) {
    const bool is_own = r.sigma_m > 0.0 && std::isfinite(r.sigma_m);
    if (!is_own) r.sigma_m = sigma_m_;
    if (r.status != ReturnStatus::kOk || !std::isfinite(r.range_m)) continue;
    is_any = true;
    is_known = is_known || std::isfinite(r.sigma_m);
  }
  if (is_any) ++(is_known ? known_ : unknown_);
}

void RangeSigmas::require_any(const std::string& scans, std::string_view or_else) const {
  if (known_ > 0 || unknown_ == 0) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("the ranges of {} come without sigma_m, so no error bar can be told: "
                          "say how good they are by --sigma M, metres{}",
                          scans, or_else));
}

}  // namespace striper::program
