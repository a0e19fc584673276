// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <ios>
#include <string>

#include "stripe/track/bridged_gaps.hpp"
#include "support/extracted_trial.hpp"
#include "support/judged_bridges.hpp"

namespace striper {

/// What was measured in gaps between sure returns, as fit_bridges.py reads it: its evidence, and 1
/// where it is the stripe, else 0, each a float.
class BridgeFile {
 public:
  explicit BridgeFile(const std::string& path) : file_(path, std::ios::binary) {
    file_.exceptions(std::ios::failbit | std::ios::badbit);
  }

  void add(const testing::Extracted& extracted) {
    testing::for_each_judged_bridge(
        extracted, [&](const detail::BridgedGaps::Bridge& bridge, bool is_right) {
          const float right = is_right ? 1.0F : 0.0F;
          file_.write(reinterpret_cast<const char*>(&bridge.evidence), sizeof bridge.evidence);
          file_.write(reinterpret_cast<const char*>(&right), sizeof right);
        });
  }

 private:
  std::ofstream file_;
};

}  // namespace striper
