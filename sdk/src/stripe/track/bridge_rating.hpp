// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace striper::detail {

/// What is known of a return that was measured in a gap between sure returns. Pixels of the image.
struct BridgeEvidence {
  enum Kind : std::size_t {
    kGain,        ///< Log of what the stripe's light explains, chi squared.
    kCoreMisfit,  ///< Logs of what the fit leaves of the pixels that the stripe is on,
    kMisfit,      ///< and of all.
    kContrast,    ///< Of the edge,
    kEdgeAway,    ///< and how far away it is, in widths.
    kOff,         ///< From the line that says where it should be, in sigmas
    kOffPixels,   ///< and pixels.
    kSigma,       ///< Logs of its error
    kLineSigma,   ///< and the line's, pixels.
    kNearer,      ///< Logs of the scan lines to the sure return on one side: the fewer,
    kFarther,     ///< and the more.
    kAsked,       ///< Of how many returns beside the near line is, on the side with fewer of two,
    kSpan,        ///< log of over how many scan lines,
    kScatter,     ///< and log of their chi squared about it over its degrees of freedom.
    kKink,        ///< How far the nearest ones bend there, pixels.
    kHeight,      ///< Log of its height over theirs,
    kHeightStep,  ///< of one of theirs over the other,
    kHeightMost,  ///< and of the highest of all that are asked over their mean.
    kBright,      ///< Log of the bright side's daylight over its height.
    kWidth,       ///< Log of the stripe's width in pixels.
    kHasOwn,      ///< Whether the scan line had a return of its own,
    kOwnOdds,     ///< its log odds,
    kOwnAway,     ///< how far away it is, pixels
    kOwnOff,      ///< and sigmas,
    kIsOwnWide,   ///< and its status.
    kIsOwnNarrow,
    kIsOneSided,     ///< Whether the line is of returns on one side alone.
    kFreeOff,        ///< From the line where little holds it to the line, pixels.
    kBeside,         ///< How many within 3 scan lines were measured in a gap, too,
    kBesideOff,      ///< how far from theirs its distance from the line is, pixels,
    kBesideGain,     ///< and the means of their logs of gain
    kBesideMisfit,   ///< and misfit of the stripe's pixels.
    kOffNear,        ///< From the line of the returns beside, pixels.
    kHasFar,         ///< Whether there is a line of many about it,
    kIsByFar,        ///< whether that says where it should be,
    kOffFar,         ///< how far from that it is, pixels,
    kFarSigma,       ///< logs of that line's error
    kFarScatter,     ///< and of its returns' scatter, in their sigmas squared,
    kFarPart,        ///< the part of them that lies on it,
    kFarAsked,       ///< and log of how many there are on the side with fewer.
    kSureOdds,       ///< Mean log odds of the returns beside,
    kLeastSureOdds,  ///< the least of them,
    kBridgedPart,    ///< and the part of them that was measured in a gap.
    kSurePart,       ///< Of the frame's scan lines, those that are sure,
    kDoubtfulPart,   ///< and those whose return is not,
    kFrameOdds,      ///< and the mean log odds of the sure ones.
    kCoverage,       ///< What is about as a stripe is, in parts of the scan lines,
    kClutter,        ///< and log of how many other candidates there are for each.
    kTexture,        ///< Log of its height over the texture beside it.
    kCount
  };
  std::array<float, kCount> of{};
};

/// How probably that is the stripe, by the mean log odds of small networks that were fitted to
/// simulated rooms and boards (tests/bench/fit_bridges.py); 0 of what is not finite. No allocation.
float bridge_probability(const BridgeEvidence& evidence) noexcept;

}  // namespace striper::detail
