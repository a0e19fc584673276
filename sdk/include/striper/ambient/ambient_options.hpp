// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <striper/core/cadence.hpp>
#include <striper/core/channel.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper {

/// How ambient light is taken off.
enum class AmbientMethod {
  kAuto,       ///< The best that the frames allow; `Scanner::decisions` says which.
  kNone,       ///< Nothing is subtracted.
  kAlternate,  ///< Lit minus dark pictures.
  kFields,     ///< Lit minus dark fields of interlaced pictures.
  kTemporal,   ///< A static sensor: minus what does not change over time.
};

struct AmbientOptions {
  AmbientMethod method = AmbientMethod::kAuto;
  Cadence
      cadence;  ///< Which exposures are lit; automatic by default. A frame's own illumination wins.
  Channel channel = Channel::kAuto;
  StripeAxis axis = StripeAxis::kColumns;  ///< How the stripe runs, for choosing the channel.
};

}  // namespace striper
