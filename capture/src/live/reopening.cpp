// SPDX-License-Identifier: Apache-2.0
#include "live/reopening.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {

Reopening::Reopening(EventPort events, std::string device, StreamKind kind, const Pauses& pauses,
                     double give_up_s)
    : events_(std::move(events)),
      device_(std::move(device)),
      kind_(std::move(kind)),
      pauses_(pauses),
      give_up_s_(give_up_s) {}

bool Reopening::lose(const std::string& why) {
  lost_at_ = Clock::now();
  pause_ = std::chrono::milliseconds{0};
  last_refusal_.clear();
  const bool is_tried = give_up_s_ > 0.0;
  events_.send({is_tried ? EventCode("source_lost") : EventCode("source_gone"),
                fmt::format("{} is lost: {}; {}", device_, why,
                            is_tried ? "trying to open it again" : "the stream ends")});
  return is_tried;
}

Reopening::Outcome Reopening::attempt(const std::function<void()>& open) {
  const auto gone_s = [this] {
    return std::chrono::duration<double>(Clock::now() - lost_at_).count();
  };
  try {
    open();
    events_.send({"source_back", fmt::format("{} is back after {:.1f} s", device_, gone_s())});
    return Outcome::kBack;
  } catch (const std::exception& failure) {  // A thread that cannot be made is no Error.
    if (gone_s() > give_up_s_) {
      events_.send(
          {"source_gone", fmt::format("{} did not come back in {:.3g} s: {}; the stream ends",
                                      device_, give_up_s_, failure.what())});
      return Outcome::kGone;
    }
    if (last_refusal_ != failure.what()) {
      last_refusal_ = failure.what();
      events_.send({"source_not_open",
                    fmt::format("{} is lost and not open yet: {}", device_, last_refusal_)});
    }
    pause_ = std::clamp(2 * pause_, pauses_.first, pauses_.longest);
    return Outcome::kNotYet;
  }
}

void Reopening::require_same(const StreamKind& now) const {
  if (now.is_same(kind_)) return;
  throw Error(ErrorKind::kDevice,
              fmt::format("{} came back with {} and was {}", device_, now.words, kind_.words));
}

}  // namespace striper::detail
