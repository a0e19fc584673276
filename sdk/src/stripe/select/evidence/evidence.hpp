// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace striper::detail {

/// What is seen of a candidate, its piece and its frame, that tells the stripe from the background.
/// Logarithms are to base 2.
struct Evidence {
  static constexpr float kUnknown = -16.0F;  ///< Where there is nothing to be seen.

  enum Kind : std::size_t {
    // Of the piece.
    kLength,       ///< Log of its candidates,
    kSupport,      ///< and of those of all pieces that it is joined with.
    kRoughness,    ///< Its bends over what noise makes of them, log,
    kBends,        ///< and beyond it, in pixels.
    kWidth,        ///< Log of its mean width over the expected one.
    kWidthSpread,  ///< About its own mean.
    kHeight,       ///< Log of its height over the main pieces'.
    kHeightChange,
    kTilt,  ///< Of the background, in heights over a width: an edge.
    kSnr,   ///< Log.
    kClipped,
    kHeightSpread,  ///< Of the logs of its heights,
    kLightSpread,   ///< and of those of its heights over the background's brightness: the laser's
                    ///< light and the room's meet the same paint.
    kLightFollows,  ///< Correlation of the logs of height and background.
    kLight,         ///< Mean log of height over background,
    kLightOff,      ///< and its difference from the main pieces'.
    kGain,          ///< Mean log of the height over that of a stripe on white paper at its range.
    kMisfit,        ///< What a Gaussian leaves of the profile, in heights.
    kTexture,       ///< Mean log of the height over the texture beside it.
    // Of the frame.
    kCoverage,  ///< Part of the scan lines that the main pieces cover,
    kClutter,   ///< and log of 1 + how many other candidates there are per scan line.
    kHidden,    ///< By its background: candidates are ridges.
    kWidthKnown,
    // Of the candidate itself.
    kOwnWidth,         ///< Log of its width over the expected one,
    kOwnWidthOfPiece,  ///< and over its piece's.
    kOwnBend,
    kOwnEnd,      ///< Scan lines to its piece's nearer end,
    kOwnOffNear,  ///< How far it lies off those beside it, pixels.
    kOwnOffFar,
    kOwnHeight,  ///< Log, over its piece's.
    kOwnSnr,
    kOwnTilt,
    kOwnMisfit,
    kOwnLight,     ///< As kLight,
    kOwnLightOff,  ///< and its difference from its piece's.
    kOwnGain,
    kOwnSigma,        ///< Log of its error over its width.
    kOwnLevelStep,    ///< Log by which the background changes to the neighbours of its piece.
    kOwnSides,        ///< Rise above the brighter side over that above the darker one.
    kOwnRank,         ///< How many candidates of its scan line are higher.
    kOwnRivals,       ///< How many there are.
    kOwnHeightNear,   ///< Log, over those about it in its piece.
    kOwnTexture,      ///< Log, over the texture beside it.
    kOwnRivalHeight,  ///< Log, over the highest other one of its scan line; 16: there is none,
    kOwnRivalAway,    ///< and log of the way to the nearest one, in widths.
    // Once all have been weighed by what is above.
    kFirst,            ///< Log odds of the candidate,
    kFirstOfPiece,     ///< mean of its piece,
    kFirstRival,       ///< of the best other candidate of its scan line,
    kFirstPieceRival,  ///< mean of that over the piece.
    kFirstCoverage,    ///< Candidates that are probably the stripe, per scan line.
    kFirstBefore,      ///< Best log odds in the scan line before the piece begins,
    kFirstAfter,       ///< and after it ends.
    kFirstWidth,  ///< Log width, height, light, gain over those of what is probably the stripe.
    kFirstHeight,
    kFirstLight,
    kFirstGain,
    kFirstNear,        ///< Mean log odds of those about it in its piece,
    kFirstNearRival,   ///< and of their rivals.
    kFirstOfJoined,    ///< Best mean log odds of a piece that its piece is joined with,
    kFirstJoined,      ///< and log of how many of their and its candidates are the stripe.
    kFirstRunnerUp,    ///< Part of the scan lines whose second best is probably the stripe.
    kFirstBackHeight,  ///< Log height over that of what is probably the background,
    kFirstBackScore,   ///< and in standard deviations of that.
    kFirstBackAsLong,  ///< Log of 1 + the background's candidates per scan line in other pieces
                       ///< that are as long as its own.
    kLineFar,          ///< LineSupport of it,
    kLineNear,
    kLineHits,
    kLineStand,
    kLineFarRival,  ///< and the best of others in its scan line.
    kLineNearRival,
    // Once all have been weighed by that, too.
    kSecond,           ///< Log odds of the candidate,
    kSecondOfPiece,    ///< mean of its piece,
    kSecondRival,      ///< of the best other candidate of its scan line,
    kSecondNear,       ///< mean of those about it in its piece,
    kSecondNearRival,  ///< and of their rivals.
    kSecondCoverage,   ///< Part of the scan lines with something that is probably the stripe.
    kSecondLineFar,    ///< LineSupport of it,
    kSecondLineNear,
    kSecondLineFarRival,  ///< and the best of others in its scan line.
    kSecondLineNearRival,
    // Of a return, once it was chosen, corrected beside edges and given its error.
    kThird,          ///< Log odds of the candidate,
    kThirdRival,     ///< of the best other candidate of its scan line,
    kThirdNear,      ///< and mean of what was chosen in the scan lines about it.
    kThirdCoverage,  ///< Part of the scan lines whose choice is probably right.
    kReturnWidth,    ///< Log of the stripe's width in pixels,
    kReturnSigma,    ///< of its error in pixels,
    kReturnWidened,  ///< and of that over what noise makes.
    kReturnMoved,    ///< By how much it was corrected, in widths.
    kReturnOffNear,  ///< Log of what it lies off the middle of those beside it, over what is right,
    kReturnOffFar,   ///< and of those farther off.
    kEdgeGain,       ///< EdgeFinding: log of what an edge explains; kUnknown: none was looked for.
    kEdgeMisfit,     ///< Log.
    kEdgeContrast,
    kEdgeAway,  ///< In widths.
    // Once all returns of a frame have been rated by that: RatedNeighbours.
    kFourth,             ///< Log odds of the return,
    kFourthBeside,       ///< means of it and of the few beside it,
    kFourthNear,         ///< of those near it,
    kFourthFar,          ///< and of those farther off.
    kFourthBefore,       ///< Log of the scan lines to the last sure return before it,
    kFourthAfter,        ///< and to the first after it.
    kFourthCoverage,     ///< Part of the scan lines whose return is sure,
    kFourthMean,         ///< and mean probability of all.
    kFourthLineNear,     ///< How many near it are nearly sure, each by its weight.
    kFourthOffNear,      ///< Log of what it lies off their straight line, over what is right,
    kFourthOddNear,      ///< and over what they scatter about it;
    kFourthScatterNear,  ///< log of that, pixels.
    kFourthLineFar,      ///< The same of those farther off.
    kFourthOffFar,
    kFourthOddFar,
    kFourthScatterFar,
    kFourthOffOneSide,  ///< What it lies off the line of those before it, or after it: the less,
    kFourthOffOther,    ///< and the more; kUnknown: on one side there is no line.
    kCount
  };
  static constexpr std::size_t kFirstKinds = kFirst;    ///< Those before anything was weighed,
  static constexpr std::size_t kSecondKinds = kSecond;  ///< before it was weighed again,
  static constexpr std::size_t kThirdKinds = kThird;    ///< before it was measured,
  static constexpr std::size_t kFourthKinds = kFourth;  ///< and before those about it were rated.

  std::array<float, kCount> of{};
};

}  // namespace striper::detail
