// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

namespace striper {

/// What became of a candidate for a scan line's stripe.
enum class CandidateFate : std::uint8_t {
  kChosen,
  kLessProbable,    ///< Another one of the scan line is more probably the stripe.
  kOutside,         ///< It lies where the model, or a limit of range, has no stripe.
  kNotSignificant,  ///< It rises no more than noise may, or is an edge.
};

/// `chosen`, `less_probable`, `outside` or `not_significant`.
std::string_view to_string(CandidateFate fate) noexcept;

/// Something in a scan line that was measured because it may be the stripe. Sensor pixels, DN.
struct LineCandidate {
  double across_px = 0.0;  ///< Position across the stripe.
  double sigma_px = 0.0;   ///< Its one-sigma error, from the noise of its pixels.
  double amplitude_dn = 0.0;
  double width_px = 0.0;      ///< Gaussian sigma, what a pixel adds included.
  double significance = 0.0;  ///< How far it rises above noise, in sigmas; 0: it was refused.
  double snr = 0.0;           ///< Amplitude over the noise of the peak pixel.
  double probability = 0.0;   ///< That it is the stripe.
  int lines = 0;              ///< How many scan lines in a row show it,
  int support = 0;            ///< and with what goes on beyond gaps.
  CandidateFate fate = CandidateFate::kNotSignificant;
};

/// The one-sigma errors of a position by cause, sensor pixels; their squares add up to that of
/// `total`. NaN where there is no position.
struct SigmaCauses {
  double read = std::numeric_limits<double>::quiet_NaN();
  double shot = read;
  double speckle = read;
  double locking = read;  ///< To the pixel grid.
  double other = read;    ///< The surface's texture and reflectance, the stripe's scatter.
  double total = read;
};

/// Why a scan line gave the return that it gave.
struct LineExplanation {
  int line = 0;             ///< Column or row of the image.
  double first_px = 0.0;    ///< Sensor pixel of the profile's first value,
  double step_px = 1.0;     ///< and of one to the next.
  std::vector<float> lit;   ///< The pixels of the scan line that were searched, DN;
  std::vector<float> dark;  ///< what was subtracted from them; empty where nothing was.

  double noise_dn = 0.0;                   ///< Of a dark pixel, one sigma.
  double least_significance = 0.0;         ///< What a candidate needs.
  double expected_width_px = 0.0;          ///< As `LineCandidate::width_px`.
  double from_px = first_px, to_px = 0.0;  ///< Between which the stripe can be, by the model.

  /// Whether scan lines were told apart by what goes on from scan line to scan line, since the
  /// background hides the stripe; else a scan line's highest peak is the stripe.
  bool is_chosen_over_lines = false;
  /// Whether the return is none of the candidates: it was measured where the sure returns about it
  /// have their straight line, together with an edge of the surface.
  bool is_bridged = false;
  std::vector<LineCandidate> candidates;  ///< The chosen one first, then by significance.
  SigmaCauses sigma_px;                   ///< Of the chosen one.
};

}  // namespace striper
