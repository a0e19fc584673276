// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>

#include "register_log.hpp"

namespace striper::detail {

/// The GenICam description of the virtual camera: what each register of feature_registers.hpp is
/// called and takes. @param lacking features that are left out, with whatever belongs to them.
std::string genicam_xml(const std::set<std::string>& lacking);

/// The names in that description, by register.
RegisterNames register_names(const std::set<std::string>& lacking);

}  // namespace striper::detail
