// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "gige/protocol/gvcp_client.hpp"

namespace striper::detail {

/// Has a camera fire test packets (GigE Vision 1.2, 24.5.2) of these sizes at this machine, as its
/// frames would come.
/// @param sizes bytes with IP and UDP headers.
/// @return those sizes of which one arrived; nothing where control of the camera is not to be had.
std::optional<std::vector<int>> sizes_that_arrive(const GvcpDevice& device,
                                                  const std::vector<int>& sizes);

}  // namespace striper::detail
