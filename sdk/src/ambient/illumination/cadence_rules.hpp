// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <striper/core/cadence.hpp>

#include "ambient/pixels/held_exposure.hpp"

namespace striper::detail {

/// Whether two cadences call the same exposures dark.
bool agree(const Cadence& a, const Cadence& b);

/// The cadence begun at another exposure, such that the same are dark as in `found`; empty if there
/// is none, or if it is not the only one.
std::optional<Cadence> turned_to(const Cadence& cadence, const Cadence& found);

/// Whether, of single fields, those that are lit are dark another time: the same rows.
bool has_dark_of_same_rows(const Cadence& cadence);

/// The shortest pattern that the exposures' own illumination follows; automatic if there is none.
Cadence pattern_of_labels(const HeldExposures& held);

}  // namespace striper::detail
