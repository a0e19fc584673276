// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <striper/profile/smooth.hpp>

#include "profile/cutter.hpp"
#include "profile/shape/curve_filter.hpp"
#include "profile/shape/seam.hpp"

namespace striper {
namespace {

using detail::Continuation;
using detail::CurveSmoother;
using detail::InverseRanges;
using detail::Run;

// What a bend has to gain over a straight line, in -2 log likelihood, to be as probable: one scan
// of a straight line in fifty gains so much (the strength is on its bound, so half of chi2 of one
// degree of freedom).
constexpr double kLeastGain = 4.0;
// A curve of less than this probability does not count.
constexpr double kLeastProbable = 0.12;
// A curve breaks off where chi2 falls by so much if it does: one of a hundred joints that are none.
// Of 9, 12, 14 and 20 this leaves the truest bars where kinds of surfaces meet.
constexpr double kBreak = 9.0;
constexpr std::size_t kNearJoint = 2;  // Returns.
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
// what they have on average counts: arcs .78, waves of 30 to 200 columns .83 to .95, zigzags 1.08.
double variance_factor(const InverseRanges& ranges, std::size_t from,
                       const std::vector<CurveSmoother::Estimate>& estimates) {
  constexpr double kOfSurfaces = 0.84;
  constexpr double kSurfacesDiffer = 0.15;
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
  return std::clamp(kOfSurfaces + trust * (measured - kOfSurfaces), 0.5, 2.0);
}

Continuation continuation(const LineFit& fit, std::size_t outermost) {
  return {{fit.parameters[0], fit.parameters[1], fit.covariance(0, 0), fit.covariance(0, 1),
           fit.covariance(1, 1)},
          0.0,
          outermost};
}

Continuation continuation(const CurveSmoother::Line& line, double density, double factor,
                          std::size_t outermost) {
  return {{line.p0, line.p1, factor * line.p00, factor * line.p01, factor * line.p11},
          factor * density,
          outermost};
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
  std::size_t end_of_curve(std::size_t first, std::size_t end) const;
  std::size_t smooth_from(std::size_t k);
  void smooth_on(const Run& run);
  void smooth_bent(std::size_t first, const Curve& bend);
  double take_curve(std::size_t from, std::size_t to, double strength);
  void blend_seams();
  void put(std::size_t i, PolarScan& scan);

  SegmentOptions options;
  detail::Cutter cutter;
  detail::CurveFilter filter;
  CurveSmoother curve;
  detail::Seam seam;
  std::vector<Curve> curves;  // Of the piece in work with more and more of those behind it.
  std::vector<CurveSmoother::Estimate> estimates;  // Per element; 0 where there is none.
  std::vector<detail::SmoothedSurface> surfaces;   // All but circles, ascending.
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
  estimates.assign(cutter.ranges.size(), {0.0, 0.0});
  surfaces.clear();
  for (std::size_t k = 0; k < cutter.runs.size();) k = smooth_from(k);
  blend_seams();
  for (std::size_t i = 0; i < estimates.size(); ++i) put(i, scan);
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
std::size_t Smoother::Impl::smooth_from(std::size_t k) {
  const Run& first = cutter.runs[k];
  if (first.is_rough) return k + 1;
  if (first.is_circular) {
    smooth_on(first);
    return k + 1;
  }
  double of_pieces = 0.0;
  curves.clear();
  Curve best{k + 1, kLeastGain, 0.0};
  filter.begin(cutter.ranges, first.from);
  for (std::size_t end = k + 1;; ++end) {
    const Run& last = cutter.runs[end - 1];
    of_pieces += last.fit.chi2 + (end > k + 1 ? segmentation.penalty : 0.0);
    filter.extend(last.to);
    const auto [strength, cost] = filter.best();
    const Curve now{end, of_pieces - cost, strength};
    curves.push_back(now);
    if (now.gain > best.gain) best = now;
    if (now.gain < best.gain - kHopeless * segmentation.penalty || !may_continue(end - 1)) break;
  }
  while (best.end > k + 1) {
    curve.smooth(cutter.ranges, first.from, cutter.runs[best.end - 1].to, best.strength);
    const std::size_t unbroken = end_of_curve(k, best.end);
    if (unbroken == best.end) break;
    best = curves[unbroken - k - 1];
  }
  if (best.end == k + 1) best = curves.front();
  smooth_bent(k, best);
  return best.end;
}

// The run behind what is one curve of those that were smoothed last: it breaks off at the joint
// that is least likely of one. Joints of short pieces alone are where a curve was cut.
std::size_t Smoother::Impl::end_of_curve(std::size_t first, std::size_t end) const {
  const std::size_t from = cutter.runs[first].from;
  const std::size_t to = cutter.runs[end - 1].to;
  double most = kBreak;
  std::size_t unbroken = end;
  for (std::size_t k = first; k + 1 < end; ++k) {
    const Run& left = cutter.runs[k];
    const Run& right = cutter.runs[k + 1];
    if (std::max(left.to - left.from, right.to - right.from) < kShort) continue;
    for (std::size_t i = std::max(left.to - kNearJoint, from);
         i <= std::min(left.to + kNearJoint, to - 1); ++i) {
      if (!(curve.breaks()[i - from] > most)) continue;
      most = curve.breaks()[i - from];
      unbroken = k + 1;
    }
  }
  return unbroken;
}

// Puts a run's returns on its line or circle.
void Smoother::Impl::smooth_on(const Run& run) {
  const InverseRanges& ranges = cutter.ranges;
  const double width =
      std::abs(std::asin(std::clamp(ranges.turn(run.from, run.to - 1), -1.0, 1.0)));
  for (std::size_t i = run.from; i < run.to; ++i) {
    const double c = ranges.cosine[i];
    const double s = ranges.sine[i];
    const detail::OnCircle on = run.is_circular
                                    ? detail::on_circle(ranges, i, run.circle)
                                    : detail::OnCircle{run.fit.at(c, s), run.fit.variance_at(c, s)};
    estimates[i] = {on.q, on.variance};
    returns[ranges.index[i]].correlation_rad = width;
  }
  if (run.is_circular) return;
  surfaces.push_back(
      {run.from, run.to, continuation(run.fit, run.from), continuation(run.fit, run.to - 1)});
}

// Runs that may be one curved surface: the mean of their lines and of the curve, each as far as it
// is probable (Hoeting et al. 1999, equations 3 and 4). Taking the more probable one for certain
// would make the bars too small by what the other one differs.
void Smoother::Impl::smooth_bent(std::size_t first, const Curve& bend) {
  const std::size_t from = cutter.runs[first].from;
  const std::size_t to = cutter.runs[bend.end - 1].to;
  const double bent = 1.0 / (1.0 + std::exp(0.5 * (kLeastGain - bend.gain)));
  const std::size_t surface = surfaces.size();
  for (std::size_t k = first; k < bend.end; ++k) smooth_on(cutter.runs[k]);
  if (bent < kLeastProbable) return;
  for (std::size_t k = surface; k + 1 < surfaces.size(); ++k)
    seam.blend(cutter.ranges, surfaces[k], surfaces[k + 1], estimates);
  const detail::SmoothedSurface straight = surfaces.back();
  surfaces.resize(surface);
  surfaces.push_back({from, to, {}, {}});
  if (bend.end == first + 1) curve.smooth(cutter.ranges, from, to, bend.strength);
  const double factor = take_curve(from, to, bend.strength);
  if (bent < 0.5) surfaces.back() = straight;  // Of one run alone.
  for (std::size_t i = from; i < to; ++i) {
    const auto [on_line, of_line] = estimates[i];
    const auto [on_curve, of_curve] = curve.estimates()[i - from];
    const double between = on_curve - on_line;
    estimates[i] = {on_line + bent * between,
                    (1.0 - bent) * (of_line + bent * between * between) + bent * factor * of_curve};
  }
}

// Notes how the last surface, which is the curve that was smoothed last, goes on. Returns by what
// its variances are to be multiplied.
double Smoother::Impl::take_curve(std::size_t from, std::size_t to, double strength) {
  const InverseRanges& ranges = cutter.ranges;
  const double factor = variance_factor(ranges, from, curve.estimates());
  const double width = kernel_width(ranges, from, strength);
  for (std::size_t i = from; i < to; ++i) returns[ranges.index[i]].correlation_rad = width;
  detail::SmoothedSurface& surface = surfaces.back();
  surface.before = continuation(curve.at_begin(), curve.density(), factor, from);
  surface.beyond = continuation(curve.at_end(), curve.density(), factor, to - 1);
  return factor;
}

void Smoother::Impl::blend_seams() {
  for (std::size_t k = 0; k + 1 < surfaces.size(); ++k) {
    if (surfaces[k].to == surfaces[k + 1].from)
      seam.blend(cutter.ranges, surfaces[k], surfaces[k + 1], estimates);
  }
}

// The new distance from the pivot, as a new range along the bearing.
void Smoother::Impl::put(std::size_t i, PolarScan& scan) {
  const auto [q, variance] = estimates[i];
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
