// SPDX-License-Identifier: Apache-2.0
// An odometer, and the truck's state, on a CAN bus.
#include <chrono>
#include <thread>
#include <utility>

#include <fmt/format.h>

#ifdef STRIPER_HAS_CAN
#include <striper/can/truck_frames.hpp>
#endif
#include <striper/core/error.hpp>

#include "guide/live/odometer_port.hpp"

namespace striper::program {

#ifdef STRIPER_HAS_CAN
namespace {

using namespace std::chrono_literals;

// A counter that wraps before the odometer's own bits do would be taken for one that jumps.
TruckFrames frames_of(CanUri& uri, int bits) {
  const std::string address = uri.text();
  TruckFrames frames = TruckFrames::of(uri);
  if (frames.counter_bits() >= bits) return frames;
  throw Error(ErrorKind::kUsage,
              fmt::format("odometer {}: size={} - expected {} or more, as the truck's file has it "
                          "(odometer: bits)",
                          address, frames.counter_bits(), bits));
}

class CanOdometer : public OdometerPort {
 public:
  CanOdometer(CanUri uri, int bits, EventPort events, OdometerHearer hearer)
      : frames_(frames_of(uri, bits)),
        address_(uri.text()),
        listener_(open_can_listener(std::move(uri), frames_.ids())),
        events_(std::move(events)),
        hearer_(std::move(hearer)),
        thread_([this](const std::stop_token& stop) { run(stop); }) {}

 private:
  void run(const std::stop_token& stop) {
    try {
      HeardFrame heard;
      while (!stop.stop_requested() && !listener_->is_over()) {
        if (!listener_->next(heard, 50ms)) continue;
        const auto word = frames_.read(heard);
        if (word) std::visit([this](const auto& one) { hearer_(one); }, *word);
      }
      if (listener_->is_over()) lose("it is at its end");
    } catch (const Error& error) {
      lose(error.what());
    }
  }

  void lose(const std::string& why) {
    events_.send({"source_lost", fmt::format("odometer {}: {}", address_, why)});
  }

  TruckFrames frames_;
  std::string address_;
  std::unique_ptr<CanListener> listener_;
  EventPort events_;
  OdometerHearer hearer_;
  std::jthread thread_;  // Last: it works on all of the above.
};

}  // namespace

std::unique_ptr<OdometerPort> detail::open_can_odometer(const std::string& address, int bits,
                                                        const EventPort& events,
                                                        OdometerHearer hearer) {
  return std::make_unique<CanOdometer>(CanUri::parse(address), bits, events, std::move(hearer));
}
#else
std::unique_ptr<OdometerPort> detail::open_can_odometer(const std::string& address, int /*bits*/,
                                                        const EventPort& /*events*/,
                                                        OdometerHearer /*hearer*/) {
  throw Error(ErrorKind::kUnsupported,
              fmt::format("odometer {}: this program was built without CAN", address));
}
#endif

}  // namespace striper::program
