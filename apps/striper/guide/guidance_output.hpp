// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <striper/guidance/guidance.hpp>

namespace striper::program {

/// Somewhere that guidance's decisions go beside the tables. Whatever way it ends, destroyed
/// without `finish` too, the last that it says is: guns off, the safe voltage.
class GuidanceOutput : public GuidanceListener {
 public:
  struct Account {
    std::uint64_t sent = 0;
    std::uint64_t lost = 0;
    const char* unit = "";  ///< What they are: frames, lines.
    std::string why;        ///< Of those that were lost.
  };

  /// Makes safe and closes. @throws Error{kIo}.
  virtual void finish() = 0;
  virtual Account account() const = 0;
};

}  // namespace striper::program
