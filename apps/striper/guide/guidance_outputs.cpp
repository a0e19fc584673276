// SPDX-License-Identifier: Apache-2.0
#include "guide/guidance_outputs.hpp"

#include <optional>
#include <system_error>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#ifdef STRIPER_HAS_CAN
#include <striper/can/guidance_can.hpp>
#endif

#include "guide/guidance_lines.hpp"
#include "summary.hpp"
#include "terminal.hpp"

namespace striper::program {
namespace {

constexpr std::string_view kLines = "jsonl:";

bool is_can(std::string_view address) {
  return address.starts_with("can:") || address.starts_with("candump:");
}

}  // namespace

const char* const kGuidanceOutputsHelp =
    "Also there, as it happens: can:INTERFACE, candump:FILE, jsonl:FILE, - (lines of JSON on the "
    "standard output); again for more";

struct GuidanceOutputs::Output {
  std::string address;
  std::unique_ptr<GuidanceLines> lines;
#ifdef STRIPER_HAS_CAN
  std::unique_ptr<GuidanceCan> can;
#endif

  GuidanceListener& open(const GuidanceConfig& config);
  bool finish() const;
};

GuidanceListener& GuidanceOutputs::Output::open(const GuidanceConfig& config) {
  if (address == "-" || address.starts_with(kLines)) {
    const std::string path = address == "-" ? address : address.substr(kLines.size());
    lines = std::make_unique<GuidanceLines>(config, path);
    return *lines;
  }
  if (!is_can(address)) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("--to {} - expected can:INTERFACE, candump:FILE, jsonl:FILE or -", address));
  }
#ifdef STRIPER_HAS_CAN
  can = open_guidance_can(address, config);
  return *can;
#else
  throw Error(ErrorKind::kUnsupported,
              fmt::format("--to {}: this program was built without CAN", address));
#endif
}

bool GuidanceOutputs::Output::finish() const {
  if (lines) lines->close();
#ifdef STRIPER_HAS_CAN
  if (!can) return true;
  can->finish();
  const CanPort& port = can->port();
  if (port.lost() == 0) {
    say(fmt::format("{}: {} sent", address, count(port.sent(), "frame")));
    return true;
  }
  say(fmt::format("{}: {} of {} were not sent: {}", address, port.lost(),
                  count(port.sent() + port.lost(), "frame"),
                  std::generic_category().message(port.last_error())));
  return false;
#else
  return true;
#endif
}

GuidanceOutputs::GuidanceOutputs(const std::vector<std::string>& addresses,
                                 const GuidanceConfig& config) {
  for (const std::string& address : addresses) {
    outputs_.push_back(std::make_unique<Output>());
    outputs_.back()->address = address;
    listeners_.push_back(&outputs_.back()->open(config));
    is_live_ = is_live_ || address.starts_with("can:");
  }
}

GuidanceOutputs::~GuidanceOutputs() = default;

void GuidanceOutputs::lateral(const LateralLine& line) {
  for (GuidanceListener* one : listeners_) one->lateral(line);
}
void GuidanceOutputs::switch_gun(std::size_t gun, bool is_on, double time_s) {
  for (GuidanceListener* one : listeners_) one->switch_gun(gun, is_on, time_s);
}
void GuidanceOutputs::gun(const GunLine& line) {
  for (GuidanceListener* one : listeners_) one->gun(line);
}
void GuidanceOutputs::seen(const SeenLine& line) {
  for (GuidanceListener* one : listeners_) one->seen(line);
}
void GuidanceOutputs::fault(const FaultLine& line) {
  for (GuidanceListener* one : listeners_) one->fault(line);
}
void GuidanceOutputs::switch_laser_off(double time_s) {
  for (GuidanceListener* one : listeners_) one->switch_laser_off(time_s);
}

bool GuidanceOutputs::finish() {
  bool is_whole = true;
  for (const auto& output : outputs_) is_whole = output->finish() && is_whole;
  return is_whole;
}

}  // namespace striper::program
