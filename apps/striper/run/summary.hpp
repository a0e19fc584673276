// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <striper/core/event.hpp>
#include <striper/core/return_status.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/stream/scan_bus.hpp>
#include <striper/stream/scan_source.hpp>

#include "run/frame_loop.hpp"

namespace striper::program {

/// Counts returns by their status, for the end of a run.
class ReturnCounts {
 public:
  void add(const PolarScan& scan) noexcept;
  void add(ReturnStatus status, std::uint64_t returns) noexcept {
    counts_[static_cast<std::size_t>(status)] += returns;
  }

  /// "1912 ok, 3 saturated, 5 no_stripe"; what there is none of is left out.
  std::string describe() const;
  nlohmann::json to_json() const;

  std::uint64_t total() const noexcept;
  std::uint64_t of(ReturnStatus status) const noexcept {
    return counts_[static_cast<std::size_t>(status)];
  }

 private:
  std::array<std::uint64_t, kReturnStatusCount> counts_{};
};

/// Says what a source lost that has ended, if anything.
void say_loss(const ScanSource& source);

/// The members that every summary has: pictures, frames, seconds, interrupted and the source's
/// counts.
nlohmann::json to_json(const FrameReport& result);

/// As a line of jsonl has it (CONVENTIONS.md).
/// `[{uri, state, written, lost}]`.
nlohmann::json to_json(const std::vector<SinkReport>& sinks);

nlohmann::json to_json(const Event& event);
nlohmann::json to_json(const std::vector<Event>& events);
nlohmann::json to_json(const ScannerStatus& status);

/// Writes a summary to the standard output, for `--json`. @throws Error{kIo}.
void print_json(const nlohmann::json& summary);

}  // namespace striper::program
