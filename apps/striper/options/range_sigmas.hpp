// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include <striper/scan/polar_scan.hpp>

#include "program/command.hpp"

namespace striper::program {

/// `--sigma M`: the error of ranges that come without one, as tables made elsewhere do.
CommandOption* add_sigma_option(Command& command, double& sigma_m);

inline constexpr double kNoSigma_m = std::numeric_limits<double>::quiet_NaN();

/// Gives ranges that come without a sigma, or none above 0, that of `--sigma`, and knows whether
/// any had one.
class RangeSigmas {
 public:
  /// @param sigma_m  NaN where --sigma was not given.
  explicit RangeSigmas(double sigma_m) noexcept : sigma_m_(sigma_m) {}

  void complete(PolarScan& scan);

  /// @param scans  where they came from, for the message.
  /// @param or_else  what may be said instead, a clause for the message.
  /// @throws Error{kUsage} naming --sigma, where there were ok ranges and no scan had one with a
  /// sigma.
  void require_any(const std::string& scans, std::string_view or_else = {}) const;

 private:
  double sigma_m_;
  std::uint64_t known_ = 0;    // Scans of which an ok return says how good it is.
  std::uint64_t unknown_ = 0;  // Scans with ok returns, none of which does.
};

}  // namespace striper::program
