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
// As many pictures tell it: the answer comes quickly.
constexpr std::size_t kMostPictures = 10;

using Load = std::function<LaserPicture(const PictureResult&)>;

// Every so many of the pictures that `counts` names and whose board was found.
template <typename Counts>
std::vector<const PictureResult*> some_of(const Calibration& calibration, const Counts& counts) {
  std::vector<const PictureResult*> all;
  for (const PictureResult& picture : calibration.pictures)
    if (picture.view >= 0 && counts(picture)) all.push_back(&picture);
  std::vector<const PictureResult*> some;
  const std::size_t step = (all.size() + kMostPictures - 1) / kMostPictures;
  for (std::size_t i = 0; i < all.size(); i += step) some.push_back(all[i]);
  return some;
}

// How many stripes lie on one plane, of pictures that should show none; 0 for fewer than half.
int stripes_in(const std::vector<const PictureResult*>& pictures, const Load& load,
               const CalibrationOptions& options, const Calibration& calibration) {
  if (static_cast<int>(pictures.size()) < kFewestStripes) return 0;
  try {
    std::vector<LaserPicture> first;
    for (std::size_t i = 0; i < std::min<std::size_t>(6, pictures.size()); ++i)
      first.push_back(load(*pictures[i]));
    const std::vector<ExtractionSettings> compared_settings =
        rank_settings(first, calibration.observations.board, calibration.solution.camera,
                      options.axis, options.channel)
            .plausible;
    int most = 0;
    for (const SettingsTrial& trial :
         try_compared_settings({compared_settings.front()}, pictures, load, options, calibration))
      most = std::max(most, trial.score.on_plane);
    return most < kFewestStripes || 2 * most < static_cast<int>(pictures.size()) ? 0 : most;
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kUntrustworthy) throw;
    return 0;  // No stripe there.
  }
}

[[noreturn]] void refuse(int there, std::size_t of, const char* where, int here,
                         const char* remedy) {
  throw Error(
      ErrorKind::kUntrustworthy,
      fmt::format("the stripe is in the pictures {} ({} of {} show it on one plane), not in "
                  "those with the laser on ({}): {}",
                  where, there, of, here, remedy));
}

}  // namespace

void refuse_swapped_lists(const CalibrationInput& input, const CalibrationOptions& options,
                          const Calibration& calibration, int on_plane) {
  const bool has_pairs = std::any_of(input.lasers.begin(), input.lasers.end(),
                                     [](const LaserPictures& laser) { return !laser.off.empty(); });
  if (has_pairs) {
    const auto pairs = some_of(calibration, [](const PictureResult& picture) {
      return picture.laser >= 0 && picture.lit.name != picture.picture.name;
    });
    const Load exchanged = [&](const PictureResult& picture) {
      LaserPicture laser = laser_picture(calibration, picture);
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
      some_of(calibration, [](const PictureResult& picture) { return picture.laser < 0; });
  const Load alone = [&](const PictureResult& picture) {
    return laser_picture(calibration, picture);
  };
  const int there = stripes_in(boards, alone, options, calibration);
  if (there > on_plane)
    refuse(there, boards.size(), "of the board alone", on_plane,
           "are the lists of boards and of laser pictures swapped?");
}

}  // namespace striper::detail
