// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <striper/ambient/asked.hpp>
#include <striper/core/channel.hpp>
#include <striper/core/event.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/core/noise_model.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper {

/// How ambient light is subtracted.
enum class AmbientMethod {
  kAuto,       ///< kFields or kAlternate where there are dark exposures, else kNone.
  kNone,       ///< Nothing is subtracted.
  kAlternate,  ///< Lit minus dark exposures, or dark fields of the same rows.
  kFields,     ///< Lit minus dark fields, interpolated where their rows lie between the lit ones.
  kTemporal,   ///< A static sensor: minus what does not change over time, a standing stripe
               ///< included. Never chosen by kAuto.
};

/// `auto`, `none`, `alternate`, `fields`, `temporal`. Static storage.
std::string_view to_string(AmbientMethod method) noexcept;

struct AmbientOptions {
  AmbientMethod method = AmbientMethod::kAuto;

  /// Which exposures are lit; automatic by default: found from the frames. A frame's own
  /// illumination wins.
  IlluminationPattern pattern;

  /// How many lasers there are, for numbering them where the pattern is found; 0 if unknown: a
  /// Scanner takes the model's.
  int lasers = 0;

  /// The camera's noise, to tell motion and edges from it; empty: measured, without shot noise. A
  /// Scanner takes it from its ExtractOptions.
  std::optional<NoiseModel> noise;

  Asked<Channel> channel = Asked<Channel>::otherwise(Channel::kAuto);
  /// Where a dark exposure, or what stands, is subtracted; empty: `channel`, a difference of
  /// colours as the colour that the stripe has. White light is gone then, and the stripe may be
  /// clearest in another channel than in a single image.
  std::optional<Channel> difference_channel;
  /// How the stripe runs. A Scanner takes it from its ExtractOptions.
  StripeAxis axis = StripeAxis::kColumns;

  /// Hears of the pattern, the fields and what is wrong with what was given.
  EventPort events;

  /// @throws Error{kBadValue} where the method needs dark exposures and the pattern has none.
  void validate() const;
};

}  // namespace striper
