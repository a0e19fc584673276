// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <striper/stream/sink_uri.hpp>

namespace striper::program {

/// Where scans are to go. @throws Error{kUsage} as `SinkUri::parse`, and where two of them are the
/// same file, however its name is written: each would overwrite the other.
std::vector<SinkUri> parse_sinks(const std::vector<std::string>& addresses);

}  // namespace striper::program
