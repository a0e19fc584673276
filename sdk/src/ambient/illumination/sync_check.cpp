// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <striper/ambient/fields.hpp>
#include <striper/ambient/sync_check.hpp>

#include "ambient/illumination/pattern_finder.hpp"

namespace striper {
namespace {

using detail::PatternFinder;

using std::chrono::milliseconds;

static_assert(SyncReport::kWindowFrames == PatternFinder::kFrames);

// Asks of a few frames after the other which exposures the laser lights.
class Windows {
 public:
  explicit Windows(StripeAxis axis) : finder_(axis, 1) {}

  void add(const Frame& frame) {
    for_each_exposure(frame, [this](const Frame& exposure) { add_exposure(exposure); });
    if (finder_.frames() < PatternFinder::kFrames) return;
    conclude(finder_.find());
    finder_.clear();
  }

  void finish(SyncReport& report) const {
    report.windows = windows_;
    report.unclear = unclear_;
    const Seen* const most = most_seen();
    if (most != nullptr) report.agreeing = most->windows;
    report.others = windows_ - unclear_ - report.agreeing;
    report.verdict = verdict_of(report);
    if (report.verdict != SyncVerdict::kLocked) return;
    report.pattern = most->pattern;
    report.surplus = most->surplus / static_cast<double>(most->windows);
    report.lit_field = most->lit_field();
  }

 private:
  struct Seen {
    IlluminationPattern pattern;
    std::uint64_t windows = 0;
    double surplus = 0.0;  // Their sum.
    bool lights_top = false;
    bool lights_bottom = false;

    Field lit_field() const {
      if (lights_top == lights_bottom) return Field::kProgressive;
      return lights_top ? Field::kTop : Field::kBottom;
    }
  };
  struct Place {
    std::uint64_t number;
    Field field;
  };

  static SyncVerdict verdict_of(const SyncReport& report) {
    constexpr std::uint64_t kEnough = 3;
    constexpr double kMost = 0.7;
    constexpr double kSome = 0.05;
    const auto share = [&](std::uint64_t windows) {
      return static_cast<double>(windows) / static_cast<double>(report.windows);
    };
    if (report.windows < kEnough) return SyncVerdict::kTooFew;
    if (share(report.others) > kSome) return SyncVerdict::kSlipping;
    return share(report.agreeing) >= kMost ? SyncVerdict::kLocked : SyncVerdict::kNoDifference;
  }

  void add_exposure(const Frame& exposure) {
    finder_.add(exposure, exposure.exposure_number());
    places_.push_back({exposure.exposure_number(), exposure.field});
  }

  void conclude(const PatternFinder::Finding& finding) {
    // Of a laser that is always on or off the exposures differ by a twentieth of a clear stripe.
    constexpr double kDiffer = 0.1;
    ++windows_;
    if (!finding.pattern.is_automatic()) {
      note(finding);
    } else if (finding.residual_rms < kDiffer) {
      ++unclear_;
    }
    places_.clear();
  }

  void note(const PatternFinder::Finding& finding) {
    const auto same = std::find_if(seen_.begin(), seen_.end(), [&](const Seen& seen) {
      return seen.pattern == finding.pattern;
    });
    Seen& seen = same != seen_.end() ? *same : seen_.emplace_back(Seen{finding.pattern});
    ++seen.windows;
    seen.surplus += finding.surplus;
    for (const Place& place : places_) {
      if (!finding.pattern.at(place.number).is_lit()) continue;
      seen.lights_top = seen.lights_top || place.field == Field::kTop;
      seen.lights_bottom = seen.lights_bottom || place.field == Field::kBottom;
    }
  }

  const Seen* most_seen() const {
    const auto most =
        std::max_element(seen_.begin(), seen_.end(),
                         [](const Seen& a, const Seen& b) { return a.windows < b.windows; });
    return most != seen_.end() ? &*most : nullptr;
  }

  PatternFinder finder_;
  std::vector<Place> places_;  // Of the window's exposures.
  std::vector<Seen> seen_;
  std::uint64_t windows_ = 0;
  std::uint64_t unclear_ = 0;
};

// Least squares of time over frame number: the rate, and how uneven the times are.
class Beat {
 public:
  void add(const Frame& frame) {
    if (!points_.empty() && points_.back().first == static_cast<double>(frame.sequence)) return;
    points_.emplace_back(static_cast<double>(frame.sequence),
                         1e-9 * static_cast<double>(frame.time.monotonic_ns - origin(frame)));
  }

  void finish(SyncReport& report) const {
    const auto count = static_cast<double>(points_.size());
    if (points_.size() < 3) return;
    double mean_n = 0.0;
    double mean_t = 0.0;
    for (const auto& [n, t] : points_) mean_n += n / count, mean_t += t / count;
    double nn = 0.0;
    double nt = 0.0;
    for (const auto& [n, t] : points_) {
      nn += (n - mean_n) * (n - mean_n);
      nt += (n - mean_n) * (t - mean_t);
    }
    const double period_s = nt / nn;
    double squares = 0.0;
    for (const auto& [n, t] : points_) {
      const double late_s = t - mean_t - period_s * (n - mean_n);
      squares += late_s * late_s;
    }
    report.rate_hz = period_s > 0.0 ? 1.0 / period_s : 0.0;
    report.jitter_ms = 1e3 * std::sqrt(squares / count);
  }

 private:
  std::int64_t origin(const Frame& frame) {
    if (points_.empty()) origin_ns_ = frame.time.monotonic_ns;
    return origin_ns_;
  }

  std::vector<std::pair<double, double>> points_;
  std::int64_t origin_ns_ = 0;
};

}  // namespace

SyncReport check_sync(FrameSource& source, const SyncCheckOptions& options) {
  constexpr milliseconds kPatience{200};
  constexpr int kSilences = 25;
  SyncReport report;
  Windows windows(options.axis);
  Beat beat;
  source.start();
  report.nominal_rate_hz = source.info().picture_rate_hz;
  std::optional<std::int64_t> begin_ns;
  Frame frame;
  int silences = 0;
  while (silences < kSilences && !(options.is_cancelled && options.is_cancelled())) {
    const NextStatus status = source.next(frame, kPatience);
    if (status == NextStatus::kTimeout) {
      ++silences;
      continue;
    }
    if (status != NextStatus::kFrame) break;
    silences = 0;
    if (!begin_ns) begin_ns = frame.time.monotonic_ns;
    if (1e-9 * static_cast<double>(frame.time.monotonic_ns - *begin_ns) > options.seconds) break;
    if (frame.status != FrameStatus::kOk) continue;
    report.field = frame.field;
    report.exposures_per_picture = frame.exposures_per_picture;
    beat.add(frame);
    windows.add(frame);
  }
  report.statistics = source.statistics();
  frame = {};
  source.stop();
  windows.finish(report);
  beat.finish(report);
  return report;
}

}  // namespace striper
