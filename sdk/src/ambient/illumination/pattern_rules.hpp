// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <striper/core/illumination_pattern.hpp>

#include "ambient/pixels/held_exposure.hpp"

namespace striper::detail {

/// Whether two patterns call the same exposures dark.
bool agree(const IlluminationPattern& a, const IlluminationPattern& b);

/// The pattern begun at another exposure, such that the same are dark as in `found`; empty if there
/// is none, or if it is not the only one.
std::optional<IlluminationPattern> turned_to(const IlluminationPattern& pattern,
                                             const IlluminationPattern& found);

/// Whether, of single fields, those that are lit are dark another time: the same rows.
bool has_dark_of_same_rows(const IlluminationPattern& pattern);

/// The shortest pattern that the exposures' own illumination follows; automatic if there is none.
IlluminationPattern pattern_of_labels(const HeldExposures& held);

}  // namespace striper::detail
