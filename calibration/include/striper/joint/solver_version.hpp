// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace striper {

/// The version of the solver that calibrations are made with, for the model file's provenance.
std::string solver_version();

}  // namespace striper
