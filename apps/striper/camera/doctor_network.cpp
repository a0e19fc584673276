// SPDX-License-Identifier: Apache-2.0
#include "camera/doctor_network.hpp"

#ifdef STRIPER_HAS_ARAVIS
#include <fmt/format.h>

#include <striper/gige/gige_network.hpp>
#include <striper/gige/gige_source.hpp>
#endif

namespace striper::program {

#ifdef STRIPER_HAS_ARAVIS

namespace {

GigeStatistics statistics_of(const FrameSource& source) {
  const auto* const camera = dynamic_cast<const GigeSource*>(&source);
  return camera != nullptr ? camera->stream_statistics() : GigeStatistics{};
}

void conclude(const GigeStatistics& network, std::vector<Event>& findings) {
  if (network.socket_drops > 0) {
    findings.push_back({"packets_lost",
                        fmt::format("this machine threw {} packets away: the socket's buffer of {} "
                                    "kB was full",
                                    network.socket_drops, network.socket_buffer_bytes / 1024),
                        "`sysctl -w net.core.rmem_max=33554432`, or packet_delay_us="});
  }
  if (network.resend_requests > 0) {
    findings.push_back({Severity::kWarning, "packets_lost",
                        fmt::format("{} packets were lost and asked for again, {} of them came",
                                    network.resend_requests, network.resent_packets),
                        "cable, switch, or too short a pause between packets (packet_delay_us=)"});
  }
  if (network.packet_bytes > 0 && network.packet_bytes < 1400) {
    findings.push_back({"packets_small",
                        fmt::format("packets of {} bytes: the way is narrow", network.packet_bytes),
                        "raise the MTU of the interface and the switch"});
  }
}

}  // namespace

std::vector<Event> examine_network(const SourceUri& uri) {
  if (uri.scheme() != "gige") return {};
  return examine_gige_network(uri.path());
}

void conclude_network(const FrameSource& source, std::vector<Event>& findings) {
  conclude(statistics_of(source), findings);
}

int packet_bytes_of(const FrameSource& source) { return statistics_of(source).packet_bytes; }

std::vector<Event> examine_silence(const SourceUri& uri, int packet_bytes) {
  if (uri.scheme() != "gige") return {};
  return examine_gige_stream(uri.path(), packet_bytes);
}

#else

std::vector<Event> examine_network(const SourceUri& /*uri*/) { return {}; }
void conclude_network(const FrameSource& /*source*/, std::vector<Event>& /*findings*/) {}
int packet_bytes_of(const FrameSource& /*source*/) { return 0; }
std::vector<Event> examine_silence(const SourceUri& /*uri*/, int /*packet_bytes*/) { return {}; }

#endif

}  // namespace striper::program
