// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gige/protocol/feature_access.hpp"

namespace striper::detail {

/// Turns on the camera's own following of the network's time (PTP, IEEE 1588).
/// @throws Error{kUnsupported} naming the features that were looked for.
void enable_ptp(const FeatureAccess& features);

/// What the camera says of its following: `Slave`, `Listening`, ...; empty where it does not say.
std::string ptp_status(const FeatureAccess& features);

/// Whether a camera in this state has the network's time: it follows a master, or is the master.
bool is_ptp_time(const std::string& status) noexcept;

/// UTC of a PTP time, both in nanoseconds since 1970.
///
/// PTP counts TAI, which is ahead of UTC by whole leap seconds (37 since 2017; the kernel's number
/// where an administrator's daemon has set it); some masters send UTC as it is. Which one it is
/// shows in the host's own clock, if that is right to half a second.
/// @return empty where neither fits: a master without a time source, counting from its start.
std::optional<std::int64_t> utc_of_ptp(std::int64_t ptp_ns, std::int64_t host_utc_ns) noexcept;

}  // namespace striper::detail
