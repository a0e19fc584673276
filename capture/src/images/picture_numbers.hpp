// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace striper::detail {

/// The numbers of image files that have none but in their names, from 0, in their order; a gap is a
/// lost frame.
///
/// `shot_007, shot_008, shot_010, ...` are 0, 1, 3, ..., and so are `shot_70, shot_80, shot_100,
/// ...`: six names or more that differ only in their last number, which grows by one and the same
/// step or by multiples of it, the step itself more often than not, however many are missing
/// elsewhere: whoever lost or took them away, the illumination pattern went on. Names that follow
/// no such rule are numbered one after the other. @param files in natural order.
std::vector<std::uint64_t> image_numbers(const std::vector<std::filesystem::path>& files);

}  // namespace striper::detail
