// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <striper/core/event.hpp>
#include <striper/profile/tools.hpp>

namespace striper::program {

/// What measured values have to be, and whether they were.
class MeasureLimits {
 public:
  /// @param texts  `ROW=A..B`; A or B may be left out.
  /// @throws Error{kUsage} naming the text and what was expected.
  explicit MeasureLimits(const std::vector<std::string>& texts);

  /// Gives limits of a tool's name to its only row.
  /// @throws Error{kUsage} where a limit is of no row.
  void require_rows(const std::vector<std::string>& rows);

  /// Counts, and sends limit_broken where a value leaves its limits (not while it stays outside).
  void look_at(const Measurement& measurement, std::uint64_t frame, const EventPort& events);

  /// Whether every limit was kept, and what it is of was measured once at least.
  bool are_kept() const;

  /// A sentence for each limit.
  std::vector<std::string> verdicts() const;

  /// `[{"tool","from","to","measured","broken","worst"}]`, null where a side is open.
  nlohmann::json to_json() const;

 private:
  struct Limit {
    std::string row;
    double from;
    double to;
    std::uint64_t measured = 0;
    std::uint64_t broken = 0;
    double worst = 0.0;  // The value that was farthest outside.
    bool is_outside = false;

    double excess(double value) const noexcept;
    bool is_kept() const noexcept { return measured > 0 && broken == 0; }
    std::string interval() const;
  };
  std::vector<Limit> limits_;
};

}  // namespace striper::program
