// SPDX-License-Identifier: Apache-2.0
#include "run/summary.hpp"

#include <cerrno>
#include <numeric>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include <striper/core/error.hpp>

#include "program/terminal.hpp"

namespace striper::program {

void ReturnCounts::add(const PolarScan& scan) noexcept {
  for (const Return& r : scan.returns) ++counts_[static_cast<std::size_t>(r.status)];
}

std::uint64_t ReturnCounts::total() const noexcept {
  return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
}

std::string ReturnCounts::describe() const {
  std::string text;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    if (counts_[i] == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", counts_[i],
                        to_string(static_cast<ReturnStatus>(i)));
  }
  return text.empty() ? "none" : text;
}

nlohmann::json ReturnCounts::to_json() const {
  nlohmann::json json;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    json[std::string(to_string(static_cast<ReturnStatus>(i)))] = counts_[i];
  }
  return json;
}

void say_loss(const ScanSource& source) {
  if (const std::string loss = source.loss(); !loss.empty()) say("lost: " + loss);
}

nlohmann::json to_json(const FrameReport& result) {
  const SourceStatistics& source = result.statistics;
  return {
      {"pictures", result.pictures},     {"frames", result.frames},
      {"seconds", result.elapsed_s},     {"interrupted", result.interrupted},
      {"dropped", source.dropped},       {"overrun", source.overrun},
      {"corrupt", source.corrupt},       {"incomplete", source.incomplete},
      {"wrong_size", source.wrong_size}, {"reconnects", source.reconnects},
      {"lost", result.is_lost},
  };
}

nlohmann::json to_json(const std::vector<SinkReport>& sinks) {
  nlohmann::json list = nlohmann::json::array();
  for (const SinkReport& sink : sinks) {
    list.push_back({{"uri", sink.uri},
                    {"state", to_string(sink.state)},
                    {"written", sink.written},
                    {"lost", sink.lost}});
  }
  return list;
}

nlohmann::json to_json(const Event& event) {
  return {{"event", event.code.word()}, {"severity", to_string(event.severity)},
          {"head", event.head},         {"time_s", event.time_s},
          {"message", event.message},   {"advice", event.advice}};
}

nlohmann::json to_json(const std::vector<Event>& events) {
  nlohmann::json list = nlohmann::json::array();
  for (const Event& event : events) list.push_back(to_json(event));
  return list;
}

nlohmann::json to_json(const ScannerStatus& status) {
  const AmbientStatus& ambient = status.ambient;
  const ScannerStatistics& counts = status.counts;
  const bool is_known = ambient.origin != PatternOrigin::kNone;
  return {{"axis", to_string(status.axis)},
          {"stripe_seen", status.is_stripe_seen},
          {"pattern", is_known ? nlohmann::json(ambient.pattern.to_string()) : nullptr},
          {"origin", to_string(ambient.origin)},
          {"phase", to_string(ambient.phase)},
          {"channel", ambient.channel ? nlohmann::json(to_string(*ambient.channel)) : nullptr},
          {"ambient", to_string(ambient.method)},
          {"counts",
           {{"frames", counts.frames},
            {"scans", counts.scans},
            {"without_stripe", counts.without_stripe},
            {"dark", counts.dark},
            {"unpaired", counts.unpaired},
            {"lit_s", counts.lit_s},
            {"refused", counts.refused}}}};
}

void print_json(const nlohmann::json& summary) {
  // A path need not be UTF-8.
  const std::string text =
      summary.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = ::write(STDOUT_FILENO, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      throw Error(ErrorKind::kIo, fmt::format("cannot write the summary to the standard output: {}",
                                              std::generic_category().message(errno)));
    }
    done += static_cast<std::size_t>(count);
  }
}

}  // namespace striper::program
