// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>

#include "session/calibration_steps.hpp"

namespace striper::detail {
namespace {

// Three lines of boards that were moved do not lie on one plane by chance.
constexpr int kFewestStripes = 3;
// As many images tell it: the answer comes quickly.
constexpr std::size_t kMostImages = 10;

using Load = std::function<LaserImage(const ImageResult&)>;

// Every so many of the images that `counts` names and whose board was found.
template <typename Counts>
std::vector<const ImageResult*> some_of(const Calibration& calibration, const Counts& counts) {
  std::vector<const ImageResult*> all;
  for (const ImageResult& result : calibration.images)
    if (result.view >= 0 && counts(result)) all.push_back(&result);
  std::vector<const ImageResult*> some;
  const std::size_t step = (all.size() + kMostImages - 1) / kMostImages;
  for (std::size_t i = 0; i < all.size(); i += step) some.push_back(all[i]);
  return some;
}

// How many stripes lie on one plane, of images that should show none; 0 for fewer than half.
int stripes_in(const std::vector<const ImageResult*>& images, const Load& load,
               const CalibrationOptions& options, const Calibration& calibration) {
  if (static_cast<int>(images.size()) < kFewestStripes) return 0;
  try {
    std::vector<LaserImage> first;
    for (std::size_t i = 0; i < std::min<std::size_t>(6, images.size()); ++i)
      first.push_back(load(*images[i]));
    const std::vector<ExtractionSettings> compared_settings =
        rank_settings(first, calibration.observations.board, calibration.solution.camera,
                      options.axis, options.channel)
            .plausible;
    int most = 0;
    for (const SettingsTrial& trial :
         try_compared_settings({compared_settings.front()}, images, load, options, calibration))
      most = std::max(most, trial.score.on_plane);
    return most < kFewestStripes || 2 * most < static_cast<int>(images.size()) ? 0 : most;
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kUntrustworthy) throw;
    return 0;  // No stripe there.
  }
}

[[noreturn]] void refuse(int there, std::size_t of, const char* where, int here,
                         const char* remedy) {
  throw Error(ErrorKind::kUntrustworthy,
              fmt::format("the stripe is in the images {} ({} of {} show it on one plane), not in "
                          "those with the laser on ({}): {}",
                          where, there, of, here, remedy));
}

}  // namespace

void refuse_swapped_lists(const CalibrationInput& input, const CalibrationOptions& options,
                          const Calibration& calibration, int on_plane) {
  const bool has_pairs = std::any_of(input.lasers.begin(), input.lasers.end(),
                                     [](const LaserImages& laser) { return !laser.off.empty(); });
  if (has_pairs) {
    const auto pairs = some_of(calibration, [](const ImageResult& result) {
      return result.laser >= 0 && result.lit.name != result.image.name;
    });
    const Load exchanged = [&](const ImageResult& result) {
      LaserImage laser = laser_image(calibration, result);
      std::swap(laser.on, laser.off);
      return laser;
    };
    const int there = stripes_in(pairs, exchanged, options, calibration);
    if (there > on_plane)
      refuse(there, pairs.size(), "with the laser off", on_plane,
             "are the two lists of pairs swapped? The first is with the laser off, the second with "
             "it on");
  }
  const auto boards =
      some_of(calibration, [](const ImageResult& result) { return result.laser < 0; });
  const Load alone = [&](const ImageResult& result) { return laser_image(calibration, result); };
  const int there = stripes_in(boards, alone, options, calibration);
  if (there > on_plane)
    refuse(there, boards.size(), "of the board alone", on_plane,
           "are the lists of boards and of laser images swapped?");
}

}  // namespace striper::detail
