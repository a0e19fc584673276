// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include <striper/ambient/ambient_stage.hpp>

#include "support/street.hpp"

namespace striper::testing {

/// What an ambient stage says in the end of the first pictures of a street that is built, each
/// changed beforehand; every lit exposure is taken as it comes.
inline std::string decisions_on(
    const Street& street, const AmbientOptions& options, std::uint64_t pictures,
    const std::function<void(Frame&)>& change = [](Frame&) {}) {
  AmbientStage stage(options);
  const auto take_all = [&stage] {
    while (stage.next() != nullptr) {
    }
  };
  for (std::uint64_t sequence = 0; sequence < pictures; ++sequence) {
    Frame frame = street.picture(sequence);
    change(frame);
    stage.push(frame);
    take_all();
  }
  stage.finish();
  take_all();
  return stage.decisions();
}

}  // namespace striper::testing
