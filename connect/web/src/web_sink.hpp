// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <striper/stream/scan_sink.hpp>

#include "web_address.hpp"

namespace striper::detail {

/// Scans for browsers and for Foxglove and Lichtblick, status and metrics for machines, on one
/// port. Listens from now on. @throws Error{kIo} where the port cannot be had.
std::unique_ptr<ScanSink> make_web_sink(const WebAddress& address);

}  // namespace striper::detail
