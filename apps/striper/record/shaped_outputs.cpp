// SPDX-License-Identifier: Apache-2.0
#include "record/shaped_outputs.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/stream/open_sink.hpp>

#include "program/terminal.hpp"

namespace striper::program {

ShapedOutputs::ShapedOutputs(const std::vector<SinkUri>& uris, const ShapeOptions& shape,
                             ScanBus& bus) {
  for (const SinkUri& uri : uris) {
    if (shape.is_any()) counts_.push_back(std::make_shared<ShapeCounts>());
    bus.add(uri.text(),
            shaped_sink(open_sink(uri), shape, shape.is_any() ? counts_.back() : nullptr));
  }
}

std::vector<SinkReport> ShapedOutputs::reports(const ScanBus& bus) const {
  std::vector<SinkReport> sinks = bus.sinks();
  for (std::size_t i = 0; i < counts_.size(); ++i) sinks[i].written = counts_[i]->scans;
  return sinks;
}

ReturnCounts ShapedOutputs::returns() const {
  ReturnCounts returns;
  for (int i = 0; i < kReturnStatusCount; ++i)
    returns.add(static_cast<ReturnStatus>(i),
                counts_.front()->returns[static_cast<std::size_t>(i)]);
  return returns;
}

void ShapedOutputs::say_result() const {
  if (!are_shaped()) return;
  const ShapeCounts& counts = *counts_.front();
  say(fmt::format("returns as they were written: {}", returns().describe()));
  if (counts.incomplete > 0)
    say(fmt::format("{} of fewer scans than --average asks for: the scans ended",
                    count(counts.incomplete, "mean")));
  if (counts.moved == 0) return;
  say(fmt::format("{} of {} returns moved while they were averaged: refused, status outlier",
                  counts.moved.load(), counts.moved + counts.still));
  if (has_moved())
    say("most of what is seen moves: --average is for a sensor and a scene that stand still");
}

nlohmann::json ShapedOutputs::to_json() const {
  if (!are_shaped()) return nullptr;
  const ShapeCounts& counts = *counts_.front();
  return {{"scans", counts.scans.load()},
          {"incomplete", counts.incomplete.load()},
          {"moved", counts.moved.load()},
          {"returns", returns().to_json()}};
}

bool ShapedOutputs::has_moved() const noexcept {
  return are_shaped() && counts_.front()->moved > counts_.front()->still;
}

}  // namespace striper::program
