// SPDX-License-Identifier: Apache-2.0
#include "guide/guidance_outputs.hpp"

#include <algorithm>
#include <exception>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#ifdef STRIPER_HAS_CAN
#include <striper/can/guidance_can.hpp>
#endif

#include "guide/guidance_lines.hpp"
#include "guide/queued_output.hpp"
#include "guide/run_files.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kLines = "jsonl:";
constexpr std::string_view kBus = "can:";
constexpr std::string_view kLog = "candump:";
constexpr const char* kStandardOutput = "-";

bool is_bus(std::string_view address) { return address.starts_with(kBus); }

// What an address writes; nothing for a bus and what is none.
std::optional<std::string> file_of(std::string_view address) {
  if (address == kStandardOutput) return kStandardOutput;
  if (address.starts_with(kLines)) return std::string(address.substr(kLines.size()));
#ifdef STRIPER_HAS_CAN
  if (address.starts_with(kLog)) return CanUri::parse(address).path();
#endif
  return {};
}

void refuse_taken(const std::vector<std::string>& addresses, std::vector<fs::path> taken) {
  for (const std::string& address : addresses) {
    const auto file = file_of(address);
    if (!file || *file == kStandardOutput) continue;
    const auto other = std::find_if(taken.begin(), taken.end(),
                                    [&](const fs::path& one) { return is_same_file(*file, one); });
    if (other != taken.end()) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("--to {}: {} is read or written by this run - name another file",
                              address, other->string()));
    }
    taken.emplace_back(*file);
  }
}

#ifdef STRIPER_HAS_CAN
class CanOutput : public GuidanceOutput {
 public:
  explicit CanOutput(std::unique_ptr<GuidanceCan> can) : can_(std::move(can)) {}

  void lateral(const LateralLine& line) override { can_->lateral(line); }
  void switch_gun(std::size_t gun, bool is_on, double time_s) override {
    can_->switch_gun(gun, is_on, time_s);
  }
  void fault(const FaultLine& line) override { can_->fault(line); }
  void switch_laser_off(double time_s) override { can_->switch_laser_off(time_s); }

  void finish() override { can_->finish(); }
  Account account() const override {
    const CanPort& port = can_->port();
    return {port.sent(), port.lost(), "frame", std::generic_category().message(port.last_error())};
  }

 private:
  std::unique_ptr<GuidanceCan> can_;
};
#endif

std::unique_ptr<GuidanceOutput> open_output(const std::string& address,
                                            const GuidanceConfig& config) {
  if (address == kStandardOutput || address.starts_with(kLines)) {
    return std::make_unique<GuidanceLines>(config, *file_of(address));
  }
  if (!is_bus(address) && !address.starts_with(kLog)) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("--to {} - expected can:INTERFACE, candump:FILE, jsonl:FILE or -", address));
  }
#ifdef STRIPER_HAS_CAN
  return std::make_unique<CanOutput>(open_guidance_can(address, config));
#else
  throw Error(ErrorKind::kUnsupported,
              fmt::format("--to {}: this program was built without CAN", address));
#endif
}

// @return whether it took all.
bool say_account(const std::string& address, const GuidanceOutput::Account& account) {
  if (account.lost == 0) {
    if (std::string_view(account.unit) == "frame") {
      say(fmt::format("{}: {} sent", address, count(account.sent, account.unit)));
    }
    return true;
  }
  say(fmt::format(
      "{}: {} of {} were not sent: {}", address, account.lost,
      count(account.sent + account.lost, *account.unit == '\0' ? "message" : account.unit),
      account.why.empty() ? "nobody read them in time" : account.why));
  return false;
}

}  // namespace

const char* const kGuidanceOutputsHelp =
    "Also there, as it happens: can:INTERFACE, candump:FILE, jsonl:FILE, - (lines of JSON on the "
    "standard output); again for more";

GuidanceOutputs::GuidanceOutputs(const std::vector<std::string>& addresses,
                                 const GuidanceConfig& config, const Options& options)
    : guns_(config.guns.size()) {
  refuse_taken(addresses, options.taken);
  std::vector<std::string> in_turn = addresses;
  std::stable_partition(in_turn.begin(), in_turn.end(), is_bus);
  is_live_ = options.is_live || std::any_of(in_turn.begin(), in_turn.end(), is_bus);
  for (const std::string& address : in_turn) {
    if (is_bus(address)) {
      outputs_.push_back({address, open_output(address, config)});
      continue;
    }
    outputs_.push_back(
        {address, std::make_unique<QueuedOutput>(
                      address, [address, config] { return open_output(address, config); },
                      is_live_ ? QueuedOutput::WhenFull::kDrop : QueuedOutput::WhenFull::kWait)});
  }
}

GuidanceOutputs::~GuidanceOutputs() = default;

template <typename Tell>
void GuidanceOutputs::tell_all(const Tell& tell) {
  if (!is_finished_) {
    for (const Output& output : outputs_) tell(*output.to);
  }
  for (GuidanceListener* one : others_) tell(*one);
}

void GuidanceOutputs::lateral(const LateralLine& line) {
  tell_all([&](GuidanceListener& to) { to.lateral(line); });
}
void GuidanceOutputs::switch_gun(std::size_t gun, bool is_on, double time_s) {
  tell_all([&](GuidanceListener& to) { to.switch_gun(gun, is_on, time_s); });
}
void GuidanceOutputs::gun(const GunLine& line) {
  tell_all([&](GuidanceListener& to) { to.gun(line); });
}
void GuidanceOutputs::seen(const SeenLine& line) {
  tell_all([&](GuidanceListener& to) { to.seen(line); });
}
void GuidanceOutputs::fault(const FaultLine& line) {
  tell_all([&](GuidanceListener& to) { to.fault(line); });
}
void GuidanceOutputs::switch_laser_off(double time_s) {
  tell_all([&](GuidanceListener& to) { to.switch_laser_off(time_s); });
}

void GuidanceOutputs::make_safe(const LateralLine& safe) {
  for (std::size_t gun = 0; gun < guns_; ++gun) switch_gun(gun, false, safe.time_s);
  lateral(safe);
}

bool GuidanceOutputs::finish() {
  if (std::exchange(is_finished_, true)) return is_whole_;
  std::exception_ptr failure;
  for (const Output& output : outputs_) {
    try {
      output.to->finish();
      is_whole_ = say_account(output.address, output.to->account()) && is_whole_;
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
  return is_whole_;
}

}  // namespace striper::program
