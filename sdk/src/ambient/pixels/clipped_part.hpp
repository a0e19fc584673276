// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper::detail {

/// Of the largest value: images that were made smaller or compressed clip a little below it.
inline constexpr double kClippedPart = 0.97;

}  // namespace striper::detail
