// SPDX-License-Identifier: Apache-2.0
#include "guide/live/job_totals.hpp"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>

namespace striper::program {

std::string_view to_string(LaserState state) noexcept {
  switch (state) {
    case LaserState::kOff:
      return "off";
    case LaserState::kOn:
      return "on";
    case LaserState::kLocked:
      return "locked";
  }
  return {};
}

JobTotals::JobTotals(const std::filesystem::path& directory, bool resumes) : directory_(directory) {
  if (!resumes) return;
  const std::string file = this->file().string();
  const std::string text = read_text_file(file, "the totals of a job");
  try {
    const nlohmann::json job = nlohmann::json::parse(text);
    part_ = job.at("part").get<int>() + 1;
    was_locked_ = job.at("laser").get<std::string>() == to_string(LaserState::kLocked);
    way_m_ = job.at("way_m").get<double>();
    scans_ = job.at("scans").get<std::uint64_t>();
    faults_ = job.at("faults").get<std::uint64_t>();
    for (const auto& gun : job.at("guns")) {
      guns_[gun.at("name").get<std::string>()] = {gun.at("on_m").get<double>(),
                                                  gun.at("dashes").get<std::uint64_t>()};
    }
  } catch (const nlohmann::json::exception& error) {
    throw Error(ErrorKind::kBadFile,
                fmt::format("{}: these are no totals of a job: begin another with another -o "
                            "({})",
                            file, error.what()));
  }
}

std::filesystem::path JobTotals::tables() const {
  return part_ == 1 ? directory_ : directory_ / fmt::format("part-{}", part_);
}

std::string JobTotals::text(const GuidanceTotals& now, LaserState laser) const {
  nlohmann::json job{{"part", part_},
                     {"way_m", way_m_ + now.way_m},
                     {"scans", scans_ + now.scans},
                     {"laser", to_string(laser)},
                     {"guns", nlohmann::json::array()}};
  job["faults"] = std::accumulate(now.faults.begin(), now.faults.end(), faults_);
  for (const GuidanceTotals::Gun& gun : now.guns) {
    const auto found = guns_.find(gun.name);
    const Gun before = found == guns_.end() ? Gun{} : found->second;
    job["guns"].push_back({{"name", gun.name},
                           {"on_m", before.on_m + gun.on_m},
                           {"dashes", before.dashes + gun.dashes}});
  }
  // What a gun that the truck no longer has painted in a part before was painted.
  for (const auto& [name, before] : guns_) {
    const auto is_it = [&name = name](const GuidanceTotals::Gun& gun) { return gun.name == name; };
    if (std::any_of(now.guns.begin(), now.guns.end(), is_it)) continue;
    job["guns"].push_back({{"name", name}, {"on_m", before.on_m}, {"dashes", before.dashes}});
  }
  return job.dump(2) + "\n";
}

}  // namespace striper::program
