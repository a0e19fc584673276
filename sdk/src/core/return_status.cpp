// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>

#include <striper/core/return_status.hpp>

namespace striper {
namespace {

struct Row {
  ReturnStatus status;
  Verdict verdict;
  std::string_view word;
};

// In the order of the enumerators, so that a status is its own index.
constexpr std::array<Row, kReturnStatusCount> kRows{{
    {ReturnStatus::kOk, Verdict::kGood, "ok"},
    {ReturnStatus::kSaturated, Verdict::kDoubtful, "saturated"},
    {ReturnStatus::kAmbiguous, Verdict::kDoubtful, "ambiguous"},
    {ReturnStatus::kWide, Verdict::kDoubtful, "wide"},
    {ReturnStatus::kNarrow, Verdict::kDoubtful, "narrow"},
    {ReturnStatus::kWeak, Verdict::kDoubtful, "weak"},
    {ReturnStatus::kEdge, Verdict::kDoubtful, "edge"},
    {ReturnStatus::kOutOfRange, Verdict::kDoubtful, "out_of_range"},
    {ReturnStatus::kNoStripe, Verdict::kMissing, "no_stripe"},
    {ReturnStatus::kBlind, Verdict::kMissing, "blind"},
    {ReturnStatus::kBehind, Verdict::kMissing, "behind"},
    {ReturnStatus::kOutsideModel, Verdict::kMissing, "outside_model"},
    {ReturnStatus::kFilled, Verdict::kDoubtful, "filled"},
    {ReturnStatus::kOutlier, Verdict::kDoubtful, "outlier"},
}};

constexpr bool rows_are_in_order() {
  for (std::size_t i = 0; i < kRows.size(); ++i) {
    if (static_cast<std::size_t>(kRows[i].status) != i) return false;
  }
  return true;
}
static_assert(rows_are_in_order());

}  // namespace

Verdict verdict(ReturnStatus status) noexcept {
  return kRows[static_cast<std::size_t>(status)].verdict;
}

std::string_view to_string(ReturnStatus status) noexcept {
  return kRows[static_cast<std::size_t>(status)].word;
}

std::optional<ReturnStatus> return_status_from_string(std::string_view word) noexcept {
  for (const Row& row : kRows) {
    if (row.word == word) return row.status;
  }
  return std::nullopt;
}

}  // namespace striper
