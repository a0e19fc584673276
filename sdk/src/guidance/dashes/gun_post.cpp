// SPDX-License-Identifier: Apache-2.0
#include "guidance/dashes/gun_post.hpp"

#include <algorithm>
#include <memory>

namespace striper::detail {
namespace {

constexpr std::size_t kPaintedKept = 64;

}  // namespace

GunPost::GunPost(const GuidanceConfig& config, const GuidanceGun& gun)
    : gun_(std::make_unique<PaintGun>(config.gun_options(gun))),
      line_(gun.line),
      x_m_(gun.gun.x_m),
      painted_(kPaintedKept, {0.0, 0.0}) {
  stretch_.gun = gun.name;
}

GunLine GunPost::stretch_to(const GunMoment& moment) const {
  GunLine line = stretch_;
  line.to_counts = moment.counts;
  line.to_m = moment.distance_m;
  line.length_m = line.to_m - line.from_m;
  line.total_m = line.length_m + before_m_;
  return line;
}

std::optional<GunLine> GunPost::update(const GunMoment& moment, bool is_allowed) {
  if (!is_allowed) gun_->stop();
  const bool is_on = is_allowed && gun_->update(moment.distance_m, moment.speed_m_s);
  if (!has_begun_) {
    has_begun_ = true;
    stretch_.from_counts = moment.counts;
    stretch_.from_m = moment.distance_m;
  }
  if (is_on == stretch_.is_on) return {};
  const GunLine ended = stretch_to(moment);
  before_m_ = ended.length_m;
  if (ended.is_on) {
    on_m_ += ended.length_m;
    painted_[next_++ % kPaintedKept] = {ended.from_m + x_m_, ended.to_m + x_m_};
  } else {
    ++dashes_;
  }
  stretch_.is_on = is_on;
  stretch_.from_counts = moment.counts;
  stretch_.from_m = moment.distance_m;
  return ended;
}

bool GunPost::has_painted(double at_m, double here_m) const noexcept {
  if (is_on() && at_m >= stretch_.from_m + x_m_ && at_m <= here_m + x_m_) return true;
  return std::any_of(painted_.begin(), painted_.end(), [&](const auto& one) {
    return at_m >= one.first && at_m <= one.second && one.second > one.first;
  });
}

}  // namespace striper::detail
