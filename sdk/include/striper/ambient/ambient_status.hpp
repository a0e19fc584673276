// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include <striper/ambient/ambient_options.hpp>
#include <striper/core/channel.hpp>
#include <striper/core/illumination_pattern.hpp>

namespace striper {

/// Where the pattern of lit and dark exposures comes from.
enum class PatternOrigin : std::uint8_t {
  kNone,     ///< It is not known yet.
  kGiven,    ///< By the source's address or the options.
  kFrames,   ///< The frames say themselves what lights them.
  kFound,    ///< The images show it.
  kPhase,    ///< Given, and the images show where in it they are.
  kAssumed,  ///< No dark exposure is seen: every one is taken as lit.
};

/// `none`, `given`, `frames`, `found`, `phase` or `assumed`.
std::string_view to_string(PatternOrigin origin) noexcept;

/// How sure an AmbientStage is of what lights an exposure.
enum class TrackingPhase : std::uint8_t {
  kSearching,  ///< What comes is held until the pattern is known.
  kLocked,     ///< The pattern is known and fits.
  kSuspect,    ///< The pattern that was found does not fit what came.
  kLost,       ///< The source lost its place in the pattern; nothing is scanned until it is found.
  kGiven,      ///< A pattern that was given is followed.
};

/// `searching`, `locked`, `suspect`, `lost` or `given`.
std::string_view to_string(TrackingPhase phase) noexcept;

/// How an AmbientStage stands.
struct AmbientStatus {
  IlluminationPattern pattern;  ///< As it is followed; automatic while it is not known.
  PatternOrigin origin = PatternOrigin::kNone;
  TrackingPhase phase = TrackingPhase::kSearching;
  std::optional<Channel> channel;               ///< That is searched; empty until it is chosen.
  AmbientMethod method = AmbientMethod::kNone;  ///< What is subtracted; never kAuto.
  std::uint64_t dark = 0;                       ///< Exposures without a laser.
  /// Lit exposures that could not be given because no dark neighbour was left: lost, or, as the
  /// images show, not dark.
  std::uint64_t unpaired = 0;

  /// Whether pattern and channel are decided.
  bool is_decided() const noexcept { return origin != PatternOrigin::kNone && channel.has_value(); }
};

}  // namespace striper
