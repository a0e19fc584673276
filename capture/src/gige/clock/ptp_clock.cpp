// SPDX-License-Identifier: Apache-2.0
#include "gige/clock/ptp_clock.hpp"

#include <cstdlib>

#include <sys/timex.h>

namespace striper::detail {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// TAI minus UTC. The kernel knows where ptp4l, chrony or ntpd told it; otherwise it says 0.
std::int64_t leap_seconds() noexcept {
  constexpr int kSince2017 = 37;
  timex kernel{};
  return adjtimex(&kernel) >= 0 && kernel.tai > 0 ? kernel.tai : kSince2017;
}

}  // namespace

void enable_ptp(const FeatureAccess& features) {
  features.set(features.need_one_of("PTP", {"PtpEnable", "GevIEEE1588"}), "yes");
}

std::string ptp_status(const FeatureAccess& features) {
  // SFNC 2.5: the state is of the moment of the last latch.
  if (features.has("PtpDataSetLatch")) features.execute("PtpDataSetLatch");
  const char* const name = features.first_of({"PtpStatus", "GevIEEE1588Status"});
  return name != nullptr ? features.text(name) : "";
}

bool is_ptp_time(const std::string& status) noexcept {
  return status == "Slave" || status == "Master";
}

std::optional<std::int64_t> utc_of_ptp(std::int64_t ptp_ns, std::int64_t host_utc_ns) noexcept {
  for (const std::int64_t ahead_ns : {leap_seconds() * kSecond_ns, std::int64_t{0}}) {
    const std::int64_t utc_ns = ptp_ns - ahead_ns;
    if (std::abs(utc_ns - host_utc_ns) < kSecond_ns / 2) return utc_ns;
  }
  return std::nullopt;
}

}  // namespace striper::detail
