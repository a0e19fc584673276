// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include <striper/scan/polar_scan.hpp>

#include "scan/scan_columns.hpp"

namespace striper::detail {

/// Reads a whole field as a number, `inf` and `nan` among them. False where it is none.
bool read_number(std::string_view text, double& number) noexcept;
bool read_number(std::string_view text, float& number) noexcept;
bool read_number(std::string_view text, std::uint64_t& number) noexcept;
bool read_number(std::string_view text, int& number) noexcept;

/// Reads a field into a column of a return; an empty one is NaN. Through float where the column is
/// one, so that the same bits come back.
bool read_into(std::string_view text, const ScanColumn& column, Return& out) noexcept;

}  // namespace striper::detail
