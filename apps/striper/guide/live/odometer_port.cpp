// SPDX-License-Identifier: Apache-2.0
#include "guide/live/odometer_port.hpp"

#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::program {

std::unique_ptr<OdometerPort> open_odometer_port(const std::string& address, int bits,
                                                 const EventPort& events, OdometerHearer hearer) {
  if (address.starts_with("serial:")) {
    return detail::open_serial_odometer(address, std::move(hearer));
  }
  if (address.starts_with("can:") || address.starts_with("candump:")) {
    return detail::open_can_odometer(address, bits, events, std::move(hearer));
  }
  throw Error(ErrorKind::kUnsupported,
              fmt::format("odometer '{}': expected encoder, serial:DEVICE?baud=19200, "
                          "can:INTERFACE?id=816 or candump:FILE",
                          address));
}

}  // namespace striper::program
