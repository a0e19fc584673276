// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace striper {

/// What kind of thing went wrong; programs turn it into an exit code, people read `what()`.
enum class ErrorKind {
  kUsage,        ///< The caller asked for something that makes no sense (wrong option, wrong URI).
  kNotFound,     ///< A file, directory or device that was named does not exist.
  kBadFile,      ///< A file exists and its content is wrong (syntax, field, size, truncation).
  kBadValue,     ///< A value handed to the library is outside its domain.
  kUnsupported,  ///< The thing is valid but this build, device or format cannot do it.
  kDevice,       ///< A camera refused, vanished or is held by another program.
  kIo,           ///< Reading or writing failed (disk full, pipe closed, no permission).
  kUntrustworthy,  ///< A result could be computed but must not be trusted.
};

/// Reports a failure of set-up or of input. Thrown while things are opened, loaded and configured,
/// and never per frame: frames carry their own verdict (`Frame::status`, `Return::status`).
///
/// `what()` is one sentence that names the file or field, the value found and what was expected.
class Error : public std::runtime_error {
 public:
  /// @param system_error the system's reason (an errno), 0 where there is none.
  Error(ErrorKind kind, const std::string& message, int system_error = 0)
      : std::runtime_error(message), kind_(kind), system_error_(system_error) {}

  ErrorKind kind() const noexcept { return kind_; }
  int system_error() const noexcept { return system_error_; }

 private:
  ErrorKind kind_;
  int system_error_;
};

/// Refuses a value outside of its domain.
/// @param field with what it is of, where that is not plain: `PathFilterOptions::wear_m`.
/// @param expected its domain: `above 0, below 0.1`.
/// @throws Error{kBadValue} "FIELD is VALUE; expected EXPECTED".
void require_value(bool is_good, std::string_view field, double value, std::string_view expected);

}  // namespace striper
