// SPDX-License-Identifier: Apache-2.0
#include "laser_plane/stripe_colour.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

constexpr std::size_t kFewestReturns = 10;
constexpr std::size_t kMostReturns = 200;

// How far from its middle a Gaussian stripe has light to speak of, and where there is none left
// that counts, in its sigmas: 4 % and .03 % of its height.
constexpr double kStripeSigmas = 2.5;
constexpr double kGroundSigmas = 4.0;

using Colour = std::array<double, 3>;  // Blue, green, red.

class Profile {
 public:
  Profile(const cv::Mat& image, const Eigen::Vector2d& pixel, StripeAxis axis)
      : image_(image), is_column_(axis == StripeAxis::kColumns) {
    line_ = static_cast<int>(std::lround(is_column_ ? pixel.x() : pixel.y()));
    middle_ = static_cast<int>(std::lround(is_column_ ? pixel.y() : pixel.x()));
  }

  int middle() const noexcept { return middle_; }
  bool has(int position) const noexcept {
    return position >= 0 && position < (is_column_ ? image_.rows : image_.cols) && line_ >= 0 &&
           line_ < (is_column_ ? image_.cols : image_.rows);
  }
  Colour at(int position) const {
    const cv::Point p = is_column_ ? cv::Point(line_, position) : cv::Point(position, line_);
    if (image_.depth() == CV_16U) {
      const auto& v = image_.at<cv::Vec<std::uint16_t, 3>>(p);
      return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
    }
    const auto& v = image_.at<cv::Vec3b>(p);
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
  }

 private:
  const cv::Mat& image_;
  bool is_column_;
  int line_ = 0;
  int middle_ = 0;
};

// What the ground beside a stripe is, the mean of three pixels on either side.
std::optional<Colour> ground_of(const Profile& profile, double width_px) {
  const int from = static_cast<int>(std::ceil(kGroundSigmas * width_px));
  Colour sum{};
  for (const int side : {-1, 1}) {
    for (int k = from; k < from + 3; ++k) {
      const int position = profile.middle() + side * k;
      if (!profile.has(position)) return std::nullopt;
      const Colour value = profile.at(position);
      for (std::size_t c = 0; c < 3; ++c) sum[c] += value[c] / 6.0;
    }
  }
  return sum;
}

std::optional<Colour> shares_at(const Profile& profile, double width_px, int full_scale_dn) {
  const auto ground = ground_of(profile, width_px);
  if (!ground) return std::nullopt;
  const int reach = static_cast<int>(std::ceil(kStripeSigmas * width_px));
  Colour sum{};
  for (int k = -reach; k <= reach; ++k) {
    if (!profile.has(profile.middle() + k)) continue;
    const Colour value = profile.at(profile.middle() + k);
    if (*std::max_element(value.begin(), value.end()) >= full_scale_dn) continue;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += value[c] - (*ground)[c];
  }
  const double total = sum[0] + sum[1] + sum[2];
  // Less than a DN a pixel tells no colour.
  if (!(total > 2.0 * reach)) return std::nullopt;
  for (double& share : sum) share /= total;
  return sum;
}

}  // namespace

std::optional<std::array<double, 3>> stripe_colour(const cv::Mat& image, const BoardStripe& stripe,
                                                   StripeAxis axis, int full_scale_dn) {
  std::array<std::vector<double>, 3> shares;
  const std::size_t step = std::max<std::size_t>(1, stripe.samples.size() / kMostReturns);
  for (std::size_t i = 0; i < stripe.samples.size(); i += step) {
    const StripeSample& sample = stripe.samples[i];
    if (!sample.is_white) continue;
    const auto one = shares_at(Profile(image, sample.pixel, axis), std::max(stripe.width_px, 0.5),
                               full_scale_dn);
    for (std::size_t c = 0; c < 3 && one; ++c) shares[c].push_back((*one)[c]);
  }
  if (shares[0].size() < kFewestReturns) return std::nullopt;
  Colour colour{};
  for (std::size_t c = 0; c < 3; ++c) colour[c] = std::max(0.0, upper_median(shares[c]));
  const double total = colour[0] + colour[1] + colour[2];
  for (double& share : colour) share /= total;
  return colour;
}

}  // namespace striper::detail
