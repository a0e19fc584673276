// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <striper/motion/odometer_csv.hpp>

namespace striper::program {

/// Takes an odometer's readings out of what a serial line gives: a line of text each, `COUNTS` or
/// `COUNTS,YAW_RATE_RAD_S`, spaces or a carriage return at its end.
///
/// A line that is no such numbers, or is longer than 80 bytes, is left out, and so is the first
/// one: it may have begun before it was listened to, and the end of a number is another number.
/// Memory is bounded. Not thread-safe.
class OdometerLines {
 public:
  /// What was heard until now is forgotten: the line was opened again.
  void begin_anew();
  /// @return the reading, without its time, where the byte ends a line that is one.
  std::optional<OdometerReading> take(char byte);

 private:
  std::string line_;
  bool is_whole_ = false;
};

}  // namespace striper::program
