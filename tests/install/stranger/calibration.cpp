// SPDX-License-Identifier: Apache-2.0
// Links the installed calibration library and what it stands on.
#include <cstdio>

#include <striper/joint/solver_version.hpp>

int main() {
  std::printf("calibrates with %s\n", striper::solver_version().c_str());
  return striper::solver_version().empty() ? 1 : 0;
}
