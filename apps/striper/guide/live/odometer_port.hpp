// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <striper/core/event.hpp>
#include <striper/motion/odometer_csv.hpp>

namespace striper::program {

/// An odometer that is not a camera's encoder input: gives readings, on a thread of its own, until
/// it is destroyed. A new kind is a class here and a line in `open_odometer_port`.
class OdometerPort {
 public:
  OdometerPort() = default;
  OdometerPort(const OdometerPort&) = delete;
  OdometerPort& operator=(const OdometerPort&) = delete;
  virtual ~OdometerPort() = default;
};

/// What it is called with: seconds since 1970, as scans of cameras have them.
using OdometerHearer = std::function<void(const OdometerReading&)>;

/// Opens `serial:DEVICE?baud=19200`: a line of text for each reading, `COUNTS` or
/// `COUNTS,YAW_RATE_RAD_S`, stamped when its line has ended. Lines that are no numbers are left
/// out. A device that goes away is opened again, once a second.
/// @throws Error{kBadValue, kUnsupported} naming the address and what was expected; Error{kDevice}.
std::unique_ptr<OdometerPort> open_odometer_port(const std::string& address, OdometerHearer hearer);

}  // namespace striper::program
