// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/line_watch.hpp"

#include <cstddef>

#include <opencv2/core.hpp>

namespace striper::detail {

bool LineWatch::refutes(const LitFrame& lit, const Neighbours& darks) {
  // Between rows edges leave a line of either sign, which the variance knows of.
  const cv::Mat edges = darks.is_between_rows ? lit.variance : cv::Mat();
  const auto line = sign_.of(lit.lit, lit.dark, edges, axis_);
  const auto laser = static_cast<std::size_t>(lit.laser);
  if (was_plain_.size() <= laser) was_plain_.resize(laser + 1);
  const bool is_gone = was_plain_[laser] && line.is_nothing();
  was_plain_[laser] = line.is_plainly_bright();
  if (line.is_dark() || is_gone) return true;
  if (darks.before == nullptr || darks.after == nullptr) return false;
  const auto between = sign_.of(darks.after->channel.lit, darks.before->channel.lit, {}, axis_);
  return between.is_dark() || between.is_bright();
}

}  // namespace striper::detail
