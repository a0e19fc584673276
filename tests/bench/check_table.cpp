// SPDX-License-Identifier: Apache-2.0
// Prints calibration/checks.md: the checks of a calibration, as validate/trust_checks.cpp has them.
#include <string>

#include <fmt/format.h>

#include <striper/core/event.hpp>
#include <striper/validate/trust.hpp>

int main() {
  const striper::TrustLimits limits;
  fmt::print(
      "# Checks of a calibration\n\n"
      "What `calibrate` looks for in the images, and from where on it says so. A refusal means "
      "that the model must not\nbe trusted: exit code 3. Made by `check_table > "
      "calibration/checks.md`.\n\n");
  fmt::print("| check | finding | where | what to do |\n|---|---|---|---|\n");
  for (const striper::TrustCheck& check : striper::trust_checks()) {
    fmt::print("| `{}` | {} | {}: {} {:g}{}{} | {} |\n", check.code.word(),
               to_string(check.severity), check.computed, check.beyond, check.limit(limits),
               check.unit.empty() ? "" : " ", check.unit,
               check.advice.empty() ? "it says, from the images" : check.advice);
  }
  return 0;
}
