// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <striper/ambient/ambient_stage.hpp>

#include "support/heard.hpp"
#include "support/street.hpp"

namespace striper::testing {

/// What an ambient stage said, and how it stands in the end.
struct AmbientAccount {
  AmbientStatus status;
  std::vector<Event> events;
};

/// The account of the first frames of a street that is built, each changed beforehand; every lit
/// exposure is taken as it comes.
inline AmbientAccount account_of(
    const Street& street, AmbientOptions options, std::uint64_t frames,
    const std::function<void(Frame&)>& change = [](Frame&) {}) {
  const Heard heard;
  options.events = heard.port();
  AmbientStage stage(options);
  const auto take_all = [&stage] {
    while (stage.next() != nullptr) {
    }
  };
  for (std::uint64_t sequence = 0; sequence < frames; ++sequence) {
    Frame frame = street.frame(sequence);
    change(frame);
    stage.push(frame);
    take_all();
  }
  stage.finish();
  take_all();
  return {stage.status(), heard.events()};
}

}  // namespace striper::testing
