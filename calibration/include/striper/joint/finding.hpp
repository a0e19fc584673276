// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace striper {

/// One thing that is to be said about a calibration.
struct Finding {
  enum class Severity {
    kNote,
    kWarning,
    kRefusal,  ///< The result must not be trusted: not written without `force`.
  };
  Severity severity = Severity::kNote;
  std::string code;     ///< Short and stable, for programs: `boards_parallel`.
  std::string message;  ///< What was found, with the figure and its bound.
  std::string advice;   ///< What to do about it: which picture to add.
};

/// The worst severity among the findings; kNote for none.
Finding::Severity worst(const std::vector<Finding>& findings);

/// `note`, `warning` or `refusal`.
std::string to_string(Finding::Severity severity);

}  // namespace striper
