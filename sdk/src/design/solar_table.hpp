// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper::detail {

/// data/solar/am15g.csv as text; CMake writes it.
extern const char* const kSolarTable;

}  // namespace striper::detail
