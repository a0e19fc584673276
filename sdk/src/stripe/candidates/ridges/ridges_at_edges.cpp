// SPDX-License-Identifier: Apache-2.0
#include "stripe/candidates/ridges/ridges_at_edges.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/candidates/ridges/ridges.hpp"
#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// Of what a ridge rises its peak has less height over a straight background, or it is so far off
// what does not clip: an edge is near.
constexpr float kLeastOfRise = 0.9F;
constexpr double kFarOff_px = 1.5;
// What rises above the foot of a ridge by more is another surface: sigmas of noise, and parts of
// the ridge's rise.
constexpr double kEdgeSigmas = 4.0;
constexpr double kEdgeOfRise = 0.3;
// The kernel moves a window by no more: once to the middle of three pixels, then kMostMoves = 5
// times by three (profile_kernel.cpp; a narrow plan's `aligned` is 1).
constexpr int kMoves_px = 16;
constexpr std::size_t kTogether = PeakMeasurements::kMultiple;

// A ridge in its scan line. Pixels off it are clamped to the scan line.
template <typename Pixel>
struct Ridge {
  const LitLine<Pixel>& line;
  int across;
  int distance;
  double rise_dn;
  double stripe_dn;  // What the stripe has at the ridge's feet.

  int at(int off) const { return std::clamp(across + off, 0, line.length() - 1); }
  int value(int off) const { return line.value(at(off)); }
};

// What lies on one side of a ridge.
struct Side {
  int end;           // Pixels off the ridge the surface is seen up to, this one not,
  double lit, dark;  // and as what it goes on.
};

template <typename Pixel>
Side side_of(const Ridge<Pixel>& ridge, int side, int reach, const PlanNoise& noise) {
  const int foot = side * ridge.distance;
  if (ridge.line.clipped(ridge.at(foot))) return {reach, 0.0, 0.0};
  const double variance_dn2 =
      noise.model.variance_dn2(ridge.line.lit(ridge.at(foot))) * (1.0 + noise.dark_noise_gain);
  const double step_dn =
      std::max(kEdgeSigmas * std::sqrt(2.0 * variance_dn2), kEdgeOfRise * ridge.rise_dn);
  const double limit_dn = ridge.value(foot) + step_dn;
  int beyond = ridge.distance + 1;
  while (beyond < reach && ridge.value(side * beyond) <= limit_dn) ++beyond;
  if (beyond == reach) return {reach, 0.0, 0.0};
  // A lens blurs an edge: the pixel before has some of the other surface.
  const int end = std::max(ridge.distance + 1, beyond - 1);
  Side seen{end, 0.0, 0.0};
  for (int off = ridge.distance; off < end; ++off) {
    seen.lit += ridge.line.lit(ridge.at(side * off));
    seen.dark += ridge.line.dark(ridge.at(side * off));
  }
  const double pixels = end - ridge.distance;
  seen.lit = std::max(0.0, seen.lit / pixels - ridge.stripe_dn);
  seen.dark /= pixels;
  return seen;
}

// Of a stripe's height, so far from its middle.
double part_at(double distance, double width) {
  return std::exp(-0.5 * distance * distance / (width * width));
}

template <typename Pixel>
Ridge<Pixel> ridge_at(const RidgesAtEdges::Measured& frame, const LitLine<Pixel>& line,
                      const PeakSeed& seed, double rise_dn) {
  const ProfilePlan& plan = frame.plan;
  const float across = static_cast<float>(seed.across);
  const float width =
      std::clamp(plan.width + plan.width_slope * across, plan.smallest_width, plan.largest_width);
  const double part = part_at(frame.distance_px, static_cast<double>(width));
  return {line, seed.across, frame.distance_px, rise_dn, rise_dn * part / (1.0 - part)};
}

}  // namespace

void RidgesAtEdges::measure(const Measured& frame, const std::vector<std::int32_t>& rises,
                            PeakList& peaks) {
  which_.clear();
  const ProfileImages& all = frame.at_hand.images;
  if (all.variance != nullptr) return;
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    if (rises[i] <= 0) continue;
    const bool is_low = peaks.amplitude[i] < kLeastOfRise * static_cast<float>(rises[i]);
    const double off_px = std::abs(peaks.position(i) - peaks.seeds[i].across);
    if (is_low || (off_px > kFarOff_px && peaks.clipped[i] == 0.0F)) which_.push_back(i);
  }
  if (which_.empty()) return;
  reserve(frame.at_hand.frame, frame.at_hand.axis);
  for (std::size_t first = 0; first < which_.size(); first += kTogether) {
    if (all.is_16_bit) {
      continue_surfaces<std::uint16_t>(frame, rises, peaks, first);
    } else {
      continue_surfaces<std::uint8_t>(frame, rises, peaks, first);
    }
    measure_profiles(images_of(rows_, StripeAxis::kRows), frame.plan, again_.seeds.data(),
                     static_cast<int>(again_.size()), again_.measurements());
    for (std::size_t n = 0; n < again_.size(); ++n) peaks.take(which_[first + n], again_, n);
  }
}

void RidgesAtEdges::reserve(const LitFrame& frame, StripeAxis axis) {
  const int length = line_length(frame.lit, axis);
  const int lines = axis == StripeAxis::kColumns ? frame.lit.cols : frame.lit.rows;
  which_.reserve(static_cast<std::size_t>(lines) * Ridges::kMost);
  rows_.full_scale_dn = frame.full_scale_dn;
  again_.make_room(kTogether);
  const auto fit = [&](const cv::Mat& image, cv::Mat& room, cv::Mat& rows) {
    if (image.empty()) return rows.release();
    if (room.cols < length || room.type() != image.type()) {
      room = cv::Mat::zeros(static_cast<int>(kTogether), length, image.type());
    }
    rows = room.colRange(0, length);
  };
  fit(frame.lit, lit_, rows_.lit);
  fit(frame.dark, dark_, rows_.dark);
  fit(frame.masked, masked_, rows_.masked);
}

template <typename Pixel>
void RidgesAtEdges::continue_surfaces(const Measured& frame, const std::vector<std::int32_t>& rises,
                                      const PeakList& peaks, std::size_t first) {
  const FrameAtHand& at_hand = frame.at_hand;
  const int reach = frame.plan.window + kMoves_px;
  const auto pixel = [](double dn) { return static_cast<Pixel>(std::lround(dn)); };
  again_.seeds.clear();
  for (std::size_t n = first; n < std::min(first + kTogether, which_.size()); ++n) {
    const PeakSeed& seed = peaks.seeds[which_[n]];
    const LitLine<Pixel> line(at_hand.frame, at_hand.axis, seed.line);
    const Ridge<Pixel> ridge = ridge_at(frame, line, seed, rises[which_[n]]);
    const Side before = side_of(ridge, -1, reach, at_hand.noise);
    const Side after = side_of(ridge, 1, reach, at_hand.noise);
    const auto row = static_cast<std::int32_t>(n - first);
    again_.seeds.push_back({row, seed.across});
    const int last = std::min(line.length() - 1, seed.across + reach);
    for (int k = std::max(0, seed.across - reach); k <= last; ++k) {
      const Side& side = k < seed.across ? before : after;
      const bool is_seen = std::abs(k - seed.across) < side.end;
      rows_.lit.at<Pixel>(row, k) = is_seen ? static_cast<Pixel>(line.lit(k)) : pixel(side.lit);
      if (!rows_.dark.empty()) {
        rows_.dark.at<Pixel>(row, k) =
            is_seen ? static_cast<Pixel>(line.dark(k)) : pixel(side.dark);
      }
      if (!rows_.masked.empty()) {
        rows_.masked.at<std::uint8_t>(row, k) = is_seen && line.masked(k) ? 255 : 0;
      }
    }
  }
}

}  // namespace striper::detail
