// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <striper/capture/clock_map.hpp>

namespace striper {
namespace {

constexpr double kBucket_s = 0.25;
constexpr double kFitRateFrom_s = 2.0;
constexpr double kLargestSkew = 1e-3;  // crystals are within 1e-4
constexpr double kStep_s = 5e-3;
constexpr double kUnknownRate = 1e-4;  // what the fitted rate may be off by, for long gaps
constexpr double kLateFor_ns = 1e9;

}  // namespace

void ClockMap::reset() noexcept {
  first_ = count_ = 0;
  offset_s_ = skew_ = 0.0;
  is_late_ = false;
}

void ClockMap::restart(std::int64_t device_ns, std::int64_t host_ns) noexcept {
  reset();
  device_origin_ns_ = device_ns;
  offset_origin_ns_ = host_ns - device_ns;
  last_device_ns_ = device_ns;
  keep({0.0, 0.0});
}

void ClockMap::observe(std::int64_t device_ns, std::int64_t host_ns) noexcept {
  if (count_ == 0) return restart(device_ns, host_ns);
  const Point point{1e-9 * static_cast<double>(device_ns - device_origin_ns_),
                    1e-9 * static_cast<double>(host_ns - device_ns - offset_origin_ns_)};
  if (has_stepped(point, device_ns, host_ns)) {
    ++steps_;
    return is_late_ ? restart(late_device_ns_, late_host_ns_) : restart(device_ns, host_ns);
  }
  last_device_ns_ = device_ns;
  keep(point);
  fit();
}

bool ClockMap::has_stepped(const Point& point, std::int64_t device_ns,
                           std::int64_t host_ns) noexcept {
  const double residual_s = point.delay_s - (offset_s_ + skew_ * point.device_s);
  const double gap_s = 1e-9 * static_cast<double>(device_ns - last_device_ns_);
  const bool runs_backwards = gap_s < 0.0;
  const bool is_impossibly_early = residual_s < -(kStep_s + kUnknownRate * std::abs(gap_s));
  if (runs_backwards || is_impossibly_early) {
    is_late_ = false;
    return true;
  }
  if (residual_s <= kStep_s + kUnknownRate * gap_s) {
    is_late_ = false;
    return false;
  }
  // Late: a delay, or a step. It is a step when nothing comes in time for a whole second.
  if (!is_late_ || host_ns - device_ns < late_host_ns_ - late_device_ns_) {
    late_device_ns_ = device_ns;
    late_host_ns_ = host_ns;
  }
  if (!is_late_) late_since_ns_ = host_ns;
  is_late_ = true;
  return static_cast<double>(host_ns - late_since_ns_) > kLateFor_ns;
}

void ClockMap::keep(const Point& point) noexcept {
  const auto bucket_of = [](const Point& p) { return std::floor(p.device_s / kBucket_s); };
  if (count_ > 0) {
    Point& last = points_[(first_ + count_ - 1) % kPoints];
    if (bucket_of(last) == bucket_of(point)) {
      if (point.delay_s - skew_ * point.device_s < last.delay_s - skew_ * last.device_s) {
        last = point;
      }
      return;
    }
  }
  if (count_ == kPoints) {
    first_ = (first_ + 1) % kPoints;
    --count_;
  }
  points_[(first_ + count_) % kPoints] = point;
  ++count_;
}

void ClockMap::fit() noexcept {
  std::size_t hull_size = 0;
  double mean_s = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Point& p = at(i);
    mean_s += p.device_s / static_cast<double>(count_);
    while (hull_size >= 2) {
      const Point& a = at(hull_[hull_size - 2]);
      const Point& b = at(hull_[hull_size - 1]);
      const double turn = (b.device_s - a.device_s) * (p.delay_s - a.delay_s) -
                          (b.delay_s - a.delay_s) * (p.device_s - a.device_s);
      if (turn > 0.0) break;
      --hull_size;
    }
    hull_[hull_size++] = i;
  }

  skew_ = 0.0;
  if (at(count_ - 1).device_s - at(0).device_s >= kFitRateFrom_s) {
    for (std::size_t i = 1; i < hull_size; ++i) {
      const Point& a = at(hull_[i - 1]);
      const Point& b = at(hull_[i]);
      if (b.device_s < mean_s && i + 1 < hull_size) continue;
      skew_ = std::clamp((b.delay_s - a.delay_s) / (b.device_s - a.device_s), -kLargestSkew,
                         kLargestSkew);
      break;
    }
  }
  offset_s_ = at(hull_[0]).delay_s - skew_ * at(hull_[0]).device_s;
  for (std::size_t i = 1; i < hull_size; ++i) {
    const Point& p = at(hull_[i]);
    offset_s_ = std::min(offset_s_, p.delay_s - skew_ * p.device_s);
  }
}

std::int64_t ClockMap::to_host(std::int64_t device_ns) const noexcept {
  const double device_s = 1e-9 * static_cast<double>(device_ns - device_origin_ns_);
  return device_ns + offset_origin_ns_ + std::llround(1e9 * (offset_s_ + skew_ * device_s));
}

}  // namespace striper
