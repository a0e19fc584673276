// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include <striper/core/csv_table.hpp>
#include <striper/guidance/guidance.hpp>
#include <striper/guidance/guidance_config.hpp>

namespace striper::program {

/// Writes what guidance says: lateral.csv, guns.csv, seen.csv, faults.csv. Faults are said on the
/// terminal, too.
class RunTables : public GuidanceListener {
 public:
  /// @throws Error as `AppendFile` does.
  explicit RunTables(const std::filesystem::path& directory);

  void lateral(const LateralLine& line) override {
    lateral_.add(line);
    if (++waiting_ % 256 == 0) flush();
  }
  void gun(const GunLine& line) override { guns_.add(line); }
  void seen(const SeenLine& line) override { seen_.add(line); }
  void fault(const FaultLine& line) override;

  void flush();
  void close();

 private:
  CsvWriter<LateralLine> lateral_;
  CsvWriter<GunLine> guns_;
  CsvWriter<SeenLine> seen_;
  CsvWriter<FaultLine> faults_;
  std::uint64_t waiting_ = 0;
  int said_ = 0;
};

/// What a job comes to, for programs and in words.
nlohmann::json json_of(const GuidanceTotals& totals, const GuidanceStripe& stripe);
void say_totals(const GuidanceTotals& totals, const GuidanceStripe& stripe);

}  // namespace striper::program
