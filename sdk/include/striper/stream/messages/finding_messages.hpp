// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/stream/scan_findings.hpp>
#include <striper/wire/striper_messages.hpp>

// What was found in a scan, as messages. Messages are replaced. Thread-safe on different messages.
namespace striper {

void to_message(const CurbsSeen& seen, wire::Curbs& message);
void to_message(const ObjectsSeen& seen, wire::Objects& message);

}  // namespace striper
