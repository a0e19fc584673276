// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <striper/core/event.hpp>

#include "guide/live/input_merge.hpp"

namespace striper::program {

/// An odometer that is not a camera's encoder input: gives readings, over CAN the truck's state
/// too, on a thread of its own, until it is destroyed. A new kind is a class and a line in
/// `open_odometer_port`.
class OdometerPort {
 public:
  OdometerPort() = default;
  OdometerPort(const OdometerPort&) = delete;
  OdometerPort& operator=(const OdometerPort&) = delete;
  virtual ~OdometerPort() = default;
};

/// What it is called with: times are seconds since 1970, as scans of cameras have them.
using OdometerHearer = std::function<void(const LiveInput&)>;

/// Opens an odometer.
///
/// `serial:DEVICE?baud=19200`: a line of text for each reading, `COUNTS` or
/// `COUNTS,YAW_RATE_RAD_S`, stamped when its line has ended (`OdometerLines`). A device that goes
/// away is opened again, once a second.
/// `can:INTERFACE?id=816`: the frames of a truck (`TruckFrames` has the keys), stamped by the
/// kernel; `candump:FILE`: a log of such, played at its pace.
/// @param bits of the odometer (OdometerOptions): a counter on a bus has as many or more.
/// @param events hears `source_lost` where it ends by itself.
/// @throws Error{kUsage, kBadValue, kUnsupported} naming the address and what was expected;
/// Error{kDevice}; as `open_can_listener`.
std::unique_ptr<OdometerPort> open_odometer_port(const std::string& address, int bits,
                                                 const EventPort& events, OdometerHearer hearer);

namespace detail {
std::unique_ptr<OdometerPort> open_serial_odometer(const std::string& address,
                                                   OdometerHearer hearer);
std::unique_ptr<OdometerPort> open_can_odometer(const std::string& address, int bits,
                                                const EventPort& events, OdometerHearer hearer);
}  // namespace detail

}  // namespace striper::program
