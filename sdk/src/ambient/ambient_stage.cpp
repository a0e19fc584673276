// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/ambient/fields.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr std::size_t kMostExposures = 2;

}  // namespace

AmbientStage::AmbientStage(const AmbientOptions& options)
    : options_(options), channels_(kMostExposures) {
  lit_.reserve(kMostExposures);
  channel_is_chosen_ = options.channel != Channel::kAuto;
  if (options.method != AmbientMethod::kAuto && options.method != AmbientMethod::kNone) {
    throw Error(ErrorKind::kUnsupported, "this build subtracts no ambient light: use auto or none");
  }
}

std::span<const LitFrame> AmbientStage::push(const Frame& frame) {
  lit_.clear();
  if (!channel_is_chosen_) {
    options_.channel = choose_channel(frame.image, options_.axis);
    channel_is_chosen_ = true;
  }
  if (frame.is_interlaced()) {
    for (const Frame& field : split_fields(frame)) push_exposure(field);
  } else {
    push_exposure(frame);
  }
  return lit_;
}

void AmbientStage::push_exposure(const Frame& exposure) {
  const Illumination given = exposure.illumination;
  const Illumination light =
      given.is_unknown() ? options_.cadence.at(exposure.exposure_number()) : given;
  if (light.is_dark()) {
    ++dark_;
    return;
  }
  ChannelImages& images = channels_[lit_.size()];
  select_channel(exposure.image, options_.channel, images);
  LitFrame& lit = lit_.emplace_back();
  lit.lit = images.lit;
  lit.dark = images.dark;
  lit.full_scale_dn = exposure.full_scale_dn();
  lit.grid = exposure.grid;
  lit.sequence = exposure.sequence;
  lit.time = exposure.time;
  lit.laser = light.is_lit() ? light.laser_index() : 0;
  lit.field = exposure.field;
}

std::string AmbientStage::decisions() const {
  if (!channel_is_chosen_) return {};
  return fmt::format("channel {}\ncadence {}\n", to_string(options_.channel),
                     options_.cadence.to_string());
}

}  // namespace striper
