// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <striper/gige/gige_options.hpp>

#include "gige/protocol/arv_ptr.hpp"
#include "gige/protocol/gvcp_client.hpp"

namespace striper::detail {

/// A camera that is open and under our control.
struct OpenCamera {
  GPtr<ArvCamera> camera;
  std::uint32_t address = 0;  ///< 0 for USB3 Vision.
  std::string description;    ///< Maker, model and serial.
};

/// Finds a GigE Vision camera by serial, user name, address, MAC, model or `vendor-serial`; the
/// first that answers where the name is empty.
/// @throws Error{kNotFound} naming those that are there, Error{kDevice} where it answers and is of
/// another subnet.
GvcpDevice find_gige(const std::string& name);

/// Finds and opens a camera and takes control of it.
/// @throws Error{kDevice} naming who holds it, and as `find_gige`.
OpenCamera open_camera(const GigeOptions& options);

}  // namespace striper::detail
