// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/line_watch.hpp"

#include <cstddef>

#include <opencv2/core.hpp>

namespace striper::detail {
namespace {

// A band costs as much as reading its scan lines; a stripe that is gone is gone from all.
constexpr int kBands = 40;
// Sigmas a band. Noise finds itself paths of .2 to .8, a clear stripe has up to 5; what moves makes
// a bright stripe and a dark one (the streams of ambient_stage_test.cpp).
constexpr double kLine = 1.5;
constexpr double kSurplus = 0.8;

}  // namespace

LineWatch::LineWatch(StripeAxis axis) noexcept : axis_(axis), search_(kBands) {}

bool LineWatch::Line::is_dark() const { return dark > kLine && dark > bright + kSurplus; }
bool LineWatch::Line::is_bright() const { return bright > kLine && bright > dark + kSurplus; }
bool LineWatch::Line::is_plainly_bright() const { return bright > 2.0 * kLine && is_bright(); }
bool LineWatch::Line::is_nothing() const { return bright < 0.5 * kLine && dark < 0.5 * kLine; }

LineWatch::Line LineWatch::line_of(const cv::Mat& over, const cv::Mat& under,
                                   const cv::Mat& variance) {
  search_.profile(over, variance, axis_, over_);
  search_.profile(under, variance, axis_, under_);
  const int bands = over_.plain.rows;
  const int jump =
      LinePath::most_jump(axis_ == StripeAxis::kColumns ? over.cols : over.rows, bands);
  const bool has_variance = !variance.empty();
  const float noise = search_.noise_of(over_, under_);
  const ProfilePair bright{over_, under_, has_variance, noise};
  const ProfilePair dark{under_, over_, has_variance, noise};
  return {search_.strength({&bright, 1}, bands, jump), search_.strength({&dark, 1}, bands, jump)};
}

bool LineWatch::refutes(const LitFrame& lit, const Neighbours& darks) {
  // Between rows edges leave a stripe of either sign, which the variance knows of.
  const cv::Mat edges = darks.is_between_rows ? lit.variance : cv::Mat();
  const auto line = line_of(lit.lit, lit.dark, edges);
  const auto laser = static_cast<std::size_t>(lit.laser);
  if (was_plain_.size() <= laser) was_plain_.resize(laser + 1);
  const bool is_gone = was_plain_[laser] && line.is_nothing();
  was_plain_[laser] = line.is_plainly_bright();
  if (line.is_dark() || is_gone) return true;
  if (darks.before == nullptr || darks.after == nullptr) return false;
  const auto between = line_of(darks.after->channel.lit, darks.before->channel.lit, {});
  return between.is_dark() || between.is_bright();
}

}  // namespace striper::detail
