// SPDX-License-Identifier: Apache-2.0
#include <ceres/version.h>

#include <striper/joint/solver_version.hpp>

namespace striper {

std::string solver_version() { return "Ceres " CERES_VERSION_STRING; }

}  // namespace striper
