// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <striper/profile/smooth.hpp>

#include "profile/cutter.hpp"
#include "profile/shape/curve_filter.hpp"

namespace striper {
namespace {

using detail::InverseRanges;
using detail::Run;

// What a bend has to gain over a straight line, in -2 log likelihood, to be as probable: one scan
// of a straight line in fifty gains so much (the strength is on its bound, so half of chi2 of one
// degree of freedom).
constexpr double kLeastGain = 4.0;
// Pieces of fewer returns than this, beside each other, may be one curved surface even where their
// lines do not meet.
constexpr std::size_t kShort = 16;
// The kernel of a cubic smoothing spline is 2 sqrt(2) of its scale wide.
constexpr double kKernelWidth = 2.83;
// A curve that costs so much of a piece more than at its best does not catch up: of waves, arcs,
// zigzags and boards none is smoothed worse than with twice or eight times as much.
constexpr double kHopeless = 0.5;

// By what the variances of a smoothed curve differ from what its residuals say: a surface that is
// smoother than white second derivatives is known better. Their mean is sum w e^2 / n - 1 + 2 trace
// / n (Mallows 1973), known to sqrt(2 / n); as far as that is worse than what surfaces differ by,
// the model's own is kept.
double variance_factor(const InverseRanges& ranges, std::size_t from,
                       const std::vector<detail::CurveSmoother::Estimate>& estimates) {
  constexpr double kSurfacesDiffer = 0.3;
  double squares = 0.0;
  double trace = 0.0;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const double e = ranges.q[from + i] - estimates[i].q;
    squares += ranges.weight[from + i] * e * e;
    trace += ranges.weight[from + i] * estimates[i].variance;
  }
  const auto n = static_cast<double>(estimates.size());
  const double measured = (squares - n + 2.0 * trace) / trace;
  const double chance = std::sqrt(2.0 * n) / trace;
  const double trust =
      kSurfacesDiffer * kSurfacesDiffer / (kSurfacesDiffer * kSurfacesDiffer + chance * chance);
  return std::clamp(1.0 + trust * (measured - 1.0), 0.5, 2.0);
}

double kernel_width(const InverseRanges& ranges, std::size_t from, double strength) {
  return kKernelWidth * std::abs(ranges.turn(from, from + 1)) / std::pow(strength, 0.25);
}

// The most likely curve through a run and those after it.
struct Curve {
  std::size_t end = 0;  // The run behind it.
  double gain = 0.0;    // Over the runs, in -2 log likelihood.
  double strength = 0.0;
};

}  // namespace

struct Smoother::Impl {
  void smooth_pieces(PolarScan& scan);
  bool may_continue(std::size_t k) const;
  std::size_t smooth_from(std::size_t k, PolarScan& scan);
  void smooth_on(const Run& run, PolarScan& scan);
  void smooth_bent(const Run& run, const Curve& curve, PolarScan& scan);
  void smooth_curve(std::size_t from, std::size_t to, double strength, PolarScan& scan);
  void put(std::size_t i, double q, double variance, PolarScan& scan);

  SegmentOptions options;
  detail::Cutter cutter;
  detail::CurveFilter filter;
  detail::CurveSmoother curve;
  Segmentation segmentation;
  std::vector<SmoothedReturn> returns;
};

Smoother::Smoother(const SegmentOptions& options) : impl_(std::make_unique<Impl>()) {
  options.validate();
  impl_->options = options;
}
Smoother::Smoother(Smoother&&) noexcept = default;
Smoother& Smoother::operator=(Smoother&&) noexcept = default;
Smoother::~Smoother() = default;

const std::vector<SmoothedReturn>& Smoother::returns() const noexcept { return impl_->returns; }
const Segmentation& Smoother::segmentation() const noexcept { return impl_->segmentation; }

void Smoother::smooth(PolarScan& scan) {
  impl_->cutter.cut(scan, impl_->options, impl_->segmentation);
  mark_outliers(impl_->segmentation, scan);
  impl_->returns.assign(scan.returns.size(), {});
  impl_->smooth_pieces(scan);
}

void Smoother::Impl::smooth_pieces(PolarScan& scan) {
  for (std::size_t k = 0; k < cutter.runs.size();) k = smooth_from(k, scan);
}

// Whether piece k + 1 may be on the same surface as piece k.
bool Smoother::Impl::may_continue(std::size_t k) const {
  if (k + 1 >= cutter.runs.size()) return false;
  const Run& run = cutter.runs[k];
  const Run& next = cutter.runs[k + 1];
  if (next.is_rough || next.is_circular) return false;
  return run.meets_next || (run.to - run.from < kShort && next.to - next.from < kShort);
}

// Smooths piece k, and those after it that are with it one curved surface more likely than pieces;
// returns the piece to go on with.
std::size_t Smoother::Impl::smooth_from(std::size_t k, PolarScan& scan) {
  const Run& first = cutter.runs[k];
  if (first.is_rough) return k + 1;
  if (first.is_circular) {
    smooth_on(first, scan);
    return k + 1;
  }
  double of_pieces = 0.0;
  Curve alone;
  Curve best{k + 1, kLeastGain, 0.0};
  filter.begin(cutter.ranges, first.from);
  for (std::size_t end = k + 1;; ++end) {
    const Run& last = cutter.runs[end - 1];
    of_pieces += last.fit.chi2 + (end > k + 1 ? segmentation.penalty : 0.0);
    filter.extend(last.to);
    const auto [strength, cost] = filter.best();
    const Curve now{end, of_pieces - cost, strength};
    if (end == k + 1) alone = now;
    if (now.gain > best.gain) best = now;
    if (now.gain < best.gain - kHopeless * segmentation.penalty || !may_continue(end - 1)) break;
  }
  if (best.end > k + 1) {
    smooth_curve(first.from, cutter.runs[best.end - 1].to, best.strength, scan);
  } else {
    smooth_bent(first, alone, scan);
  }
  return best.end;
}

// Puts a run's returns on its line or circle.
void Smoother::Impl::smooth_on(const Run& run, PolarScan& scan) {
  const InverseRanges& ranges = cutter.ranges;
  const double width =
      std::abs(std::asin(std::clamp(ranges.turn(run.from, run.to - 1), -1.0, 1.0)));
  for (std::size_t i = run.from; i < run.to; ++i) {
    const double c = ranges.cosine[i];
    const double s = ranges.sine[i];
    const detail::OnCircle on = run.is_circular
                                    ? detail::on_circle(ranges, i, run.circle)
                                    : detail::OnCircle{run.fit.at(c, s), run.fit.variance_at(c, s)};
    put(i, on.q, on.variance, scan);
    returns[ranges.index[i]].correlation_rad = width;
  }
}

// A run that may be a little bent: the mean of its line and the curve, each as far as it is
// probable (Hoeting et al. 1999, equations 3 and 4). Taking the more probable one for certain would
// make the bars too small by what the other one differs.
void Smoother::Impl::smooth_bent(const Run& run, const Curve& bend, PolarScan& scan) {
  if (!(bend.gain > 0.0)) {  // Less than one in nine.
    smooth_on(run, scan);
    return;
  }
  const double bent = 1.0 / (1.0 + std::exp(0.5 * (kLeastGain - bend.gain)));
  const InverseRanges& ranges = cutter.ranges;
  const auto& estimates = curve.smooth(ranges, run.from, run.to, bend.strength);
  const double factor = variance_factor(ranges, run.from, estimates);
  const double width = kernel_width(ranges, run.from, bend.strength);
  for (std::size_t i = run.from; i < run.to; ++i) {
    const double on_line = run.fit.at(ranges.cosine[i], ranges.sine[i]);
    const double of_line = run.fit.variance_at(ranges.cosine[i], ranges.sine[i]);
    const auto [on_curve, of_curve] = estimates[i - run.from];
    const double between = on_curve - on_line;
    put(i, on_line + bent * between,
        (1.0 - bent) * (of_line + bent * between * between) + bent * factor * of_curve, scan);
    returns[ranges.index[i]].correlation_rad = width;
  }
}

void Smoother::Impl::smooth_curve(std::size_t from, std::size_t to, double strength,
                                  PolarScan& scan) {
  const InverseRanges& ranges = cutter.ranges;
  const auto& estimates = curve.smooth(ranges, from, to, strength);
  const double factor = variance_factor(ranges, from, estimates);
  const double width = kernel_width(ranges, from, strength);
  for (std::size_t i = from; i < to; ++i) {
    put(i, estimates[i - from].q, factor * estimates[i - from].variance, scan);
    returns[ranges.index[i]].correlation_rad = width;
  }
}

// The new distance from the pivot, as a new range along the bearing.
void Smoother::Impl::put(std::size_t i, double q, double variance, PolarScan& scan) {
  if (!(q > 0.0)) return;
  const InverseRanges& ranges = cutter.ranges;
  Return& r = scan.returns[ranges.index[i]];
  const double distance = 1.0 / q;
  const double x = ranges.pivot.x() + ranges.cosine[i] * distance;
  const double y = ranges.pivot.y() + ranges.sine[i] * distance;
  const double range = std::sqrt(x * x + y * y);
  const double growth = range / r.range_m;
  const double of_q = ranges.q[i] * distance;
  r.sigma_m *= std::sqrt(variance / ranges.noise[i]) * of_q * of_q;
  r.range_m = range;
  r.x_m *= growth;
  r.y_m *= growth;
  returns[ranges.index[i]].sigma_m = r.sigma_m;
}

}  // namespace striper
