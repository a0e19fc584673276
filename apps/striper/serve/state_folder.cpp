// SPDX-License-Identifier: Apache-2.0
#include "serve/state_folder.hpp"

#include <cstdlib>
#include <string>

namespace striper::program {

std::filesystem::path state_folder() {
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nobody sets it.
    return std::string(value == nullptr ? "" : value);
  };
  const std::string of_service = variable("STATE_DIRECTORY");  // Several are joined by colons.
  if (!of_service.empty()) return of_service.substr(0, of_service.find(':'));
  const std::filesystem::path of_user = variable("XDG_STATE_HOME");
  if (of_user.is_absolute()) return of_user / "striper";
  const std::filesystem::path home = variable("HOME");
  return home.is_absolute() ? home / ".local/state/striper" : std::filesystem::path();
}

}  // namespace striper::program
