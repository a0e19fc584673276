// SPDX-License-Identifier: Apache-2.0
#include "scan_pieces.hpp"

#include <cmath>

#include <nlohmann/json.hpp>

#include "parameter_json.hpp"

namespace striper::detail {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr auto kKeptFor = 3s;          // After somebody asked.
constexpr std::size_t kMostKept = 64;  // Heads and lasers that anybody can name.

json to_json(const Piece& piece) {
  const Eigen::Vector2d middle = (piece.begin_m + piece.end_m) / 2.0;
  const double sigma_m = std::sqrt(piece.line.offset_variance_m2(middle));
  return {{"x1_m", piece.begin_m.x()}, {"y1_m", piece.begin_m.y()}, {"x2_m", piece.end_m.x()},
          {"y2_m", piece.end_m.y()},   {"sigma_m", sigma_m},        {"points", piece.points},
          {"is_rough", piece.is_rough}};
}

}  // namespace

void ScanPieces::see(const PolarScan& scan) {
  const std::lock_guard lock(mutex_);
  const auto found = kept_.find({std::string(scan.head()), scan.laser});
  if (found == kept_.end()) return;
  if (Clock::now() - found->second.asked > kKeptFor) {
    kept_.erase(found);
    return;
  }
  found->second.scan = scan;
  found->second.is_there = true;
}

std::string ScanPieces::json(const std::string& head, int laser) {
  const std::lock_guard lock(mutex_);
  if (kept_.size() >= kMostKept) kept_.clear();
  Kept& kept = kept_[{head, laser}];
  kept.asked = Clock::now();
  nlohmann::json pieces = nlohmann::json::array();
  nlohmann::json sequence;
  if (kept.is_there) {
    segmenter_.segment(kept.scan, segmentation_);
    for (const Piece& piece : segmentation_.pieces) pieces.push_back(to_json(piece));
    sequence = kept.scan.sequence;
  }
  return dump_json({{"sequence", sequence}, {"pieces", pieces}}) + "\n";
}

}  // namespace striper::detail
