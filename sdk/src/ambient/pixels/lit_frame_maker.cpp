// SPDX-License-Identifier: Apache-2.0
#include "ambient/pixels/lit_frame_maker.hpp"

#include <algorithm>
#include <cstddef>

#include <opencv2/core.hpp>

#include <striper/ambient/channel_choice.hpp>

namespace striper::detail {
namespace {

// A scene moves where more than this part of it is darker than what stands, in so many frames in
// a row; where a stripe was long, less is.
constexpr double kMovingPart = 0.08;
constexpr int kMovingFrames = 3;

constexpr const char* kMoves =
    "ambient temporal is for a sensor that stands still, and what it sees moves: the scans are not "
    "to be trusted";

// A difference of colours is not needed where dark exposures are subtracted, and with
// them the white light.
Channel without_difference(Channel channel) {
  if (channel == Channel::kGreenMinusRed) return Channel::kGreen;
  if (channel == Channel::kRedMinusGreen) return Channel::kRed;
  return channel;
}

void take_channel(HeldExposure& exposure, Channel wanted) {
  if (exposure.has_channel) return;
  select_channel(exposure.frame.image, wanted, exposure.channel);
  exposure.has_channel = true;
}

bool is_alike(const HeldExposure& a, const HeldExposure& b) {
  return a.light == b.light && a.frame.field == b.frame.field;
}

}  // namespace

LitFrameMaker::LitFrameMaker(const AmbientOptions& options, OnceEvents& events)
    : options_(options), events_(events), background_(options.noise) {
  if (options.channel != Channel::kAuto) channel_ = options.channel;
}

const LitFrame& LitFrameMaker::make(HeldExposure& lit, const Neighbours& darks,
                                    const HeldExposures& held) {
  const Frame& frame = lit.frame;
  // What nobody else holds is written into again.
  for (cv::Mat* const image : {&made_.lit, &made_.dark, &made_.variance, &made_.masked}) {
    image->release();
  }
  made_.dark_noise_gain = 1.0F;
  made_.dark_noise_correlation = {};
  made_.full_scale_dn = frame.full_scale_dn();
  made_.grid = frame.grid;
  made_.sequence = frame.sequence;
  made_.time = frame.time;
  made_.exposure_number = lit.number;
  made_.exposure_ns = frame.exposure_ns;
  made_.laser = lit.light.laser_index();
  made_.field = frame.field;
  subtract(lit, darks, held);
  return made_;
}

void LitFrameMaker::subtract(HeldExposure& lit, const Neighbours& darks,
                             const HeldExposures& held) {
  const HeldExposure* const any = darks.before != nullptr ? darks.before : darks.after;
  if (!channel_) choose_channel_from(lit, any);
  const bool is_difference = any != nullptr || options_.method == AmbientMethod::kTemporal;
  const Channel wanted = is_difference ? channel_of_differences() : *channel_;
  take_channel(lit, wanted);
  made_.lit = lit.channel.lit;
  made_.dark = lit.channel.dark;
  made_.is_dark_a_channel = any == nullptr && !made_.dark.empty();
  if (options_.method == AmbientMethod::kTemporal) return subtract_background(lit, held);
  if (any != nullptr) return subtract_dark(lit, darks, wanted);
  if (!made_.dark.empty()) colour_difference_.correct(made_, options_.axis);
}

void LitFrameMaker::subtract_dark(const HeldExposure& lit, const Neighbours& darks,
                                  Channel wanted) {
  DarkPair pair;
  for (HeldExposure* const dark : {darks.before, darks.after}) {
    if (dark != nullptr) take_channel(*dark, wanted);
  }
  if (darks.before != nullptr) pair.before = &darks.before->channel.lit;
  if (darks.after != nullptr) pair.after = &darks.after->channel.lit;
  if (pair.has_both()) pair.weight_after = darks.weight_after;
  pair.is_between_rows = darks.is_between_rows;
  const HeldExposure& any = darks.before != nullptr ? *darks.before : *darks.after;
  pair.row_above = lit.frame.grid.v.offset < any.frame.grid.v.offset ? -1 : 0;
  background_.subtract(pair, made_);
  (darks.is_between_rows ? subtracts_fields_ : subtracts_frames_) = true;
}

void LitFrameMaker::subtract_background(HeldExposure& lit, const HeldExposures& held) {
  TemporalBackground& standing = background_of(lit);
  if (standing.is_empty()) {
    std::vector<cv::Mat> first;
    for (const auto& other : held) {
      const bool has_size = other->frame.image.size() == lit.frame.image.size();
      if (!is_alike(*other, lit) || !has_size) continue;
      if (first.size() == TemporalBackground::kFirstImages) continue;
      take_channel(*other, channel_of_differences());
      first.push_back(other->channel.lit);
    }
    standing.begin(first);
  }
  const cv::Mat& background = standing.follow(made_.lit, std::max(1, made_.full_scale_dn / 255));
  const double moving =
      background_.subtract_standing(background, TemporalBackground::kNoiseGain, made_);
  moving_frames_ = moving > kMovingPart ? moving_frames_ + 1 : 0;
  if (moving_frames_ >= kMovingFrames) events_.send_once({"scene_moves", kMoves});
}

// A background begins with a few images.
bool LitFrameMaker::waits_for_background(const HeldExposure& lit, const HeldExposures& held) {
  if (options_.method != AmbientMethod::kTemporal || !background_of(lit).is_empty()) return false;
  const auto alike = std::count_if(held.begin(), held.end(),
                                   [&](const auto& other) { return is_alike(*other, lit); });
  return static_cast<std::size_t>(alike) < TemporalBackground::kFirstImages;
}

TemporalBackground& LitFrameMaker::background_of(const HeldExposure& lit) {
  const int parity = lit.frame.field == Field::kBottom ? 1 : 0;
  const auto index = static_cast<std::size_t>(2 * lit.light.laser_index() + parity);
  if (standing_.size() <= index) standing_.resize(index + 1);
  return standing_[index];
}

void LitFrameMaker::choose_channel_from(const HeldExposure& lit, const HeldExposure* dark) {
  if (dark == nullptr || dark->frame.image.size() != lit.frame.image.size()) {
    channel_ = choose_channel(lit.frame.image, options_.axis);
    return;
  }
  cv::Mat difference;
  cv::subtract(lit.frame.image, dark->frame.image, difference);
  channel_ = choose_channel(difference, options_.axis);
}

Channel LitFrameMaker::channel_of_differences() const noexcept {
  const bool is_given =
      options_.difference_channel && *options_.difference_channel != Channel::kAuto;
  return without_difference(is_given ? *options_.difference_channel : *channel_);
}

std::optional<Channel> LitFrameMaker::channel() const noexcept {
  const bool subtracts = method() != AmbientMethod::kNone;
  if (channel_ && subtracts && options_.difference_channel) return channel_of_differences();
  return channel_;
}

AmbientMethod LitFrameMaker::method() const noexcept {
  if (options_.method == AmbientMethod::kTemporal) return AmbientMethod::kTemporal;
  if (subtracts_fields_) return AmbientMethod::kFields;
  return subtracts_frames_ ? AmbientMethod::kAlternate : AmbientMethod::kNone;
}

}  // namespace striper::detail
