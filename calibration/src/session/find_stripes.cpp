// SPDX-License-Identifier: Apache-2.0
// How the stripe is read (axis, channel, laser-off image subtracted or not) decides which pixels
// become the plane. A first impression of some images leaves few ways; of these the stripes of
// all images are found, a plane is put through them, and they are compared by how many stripes
// lie on it and how well.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>
#include <striper/laser_plane/initial_plane.hpp>

#include "session/calibration_steps.hpp"

namespace striper::detail {
namespace {

// A stripe lies on the plane within so many times what the usual one of the best way does, and
// within so much, as when stripes are left out of the adjustment (outlier_views.cpp).
constexpr double kStripeOutlier = 3.0;
constexpr double kLeastStripePx = 1.0;

// How much better than a better first impression a way must be: on rendered sessions the merits of
// two channels with the same light differ by up to 4 %.
constexpr double kBetter = 1.05;

// Below this the corners decide how well a plane is known, not the stripes.
constexpr double kLeastRmsPx = 0.02;

StripeView view_of(const ImageResult& result, const BoardStripe& stripe) {
  StripeView view;
  view.name = result.lit.name;
  view.view = result.view;
  view.laser = std::max(result.laser, 0);
  view.pixel = stripe.pixel;
  view.sigma_px = stripe.sigma_px;
  // What blurs the board's edges blurs the stripe as well; the rest of its width is the laser's.
  view.width_px = stripe.width_px;
  view.thickness_px = std::sqrt(
      std::max(0.0, view.width_px * view.width_px - result.board.blur_px * result.board.blur_px));
  return view;
}

// Calls work(i) for each index, on several threads.
template <typename Work>
void for_each_index(std::size_t count, int threads, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::mutex lock;
  std::exception_ptr failure;
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard guard(lock);
        failure = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(run);
  run();
  for (std::thread& thread : others) thread.join();
  if (failure) std::rethrow_exception(failure);
}

// The distance of each stripe from the plane of most of its laser's, px rms; NaN where there is no
// stripe or no plane.
std::vector<double> distances_px(const SettingsTrial& trial,
                                 const std::vector<const ImageResult*>& images,
                                 const Calibration& calibration) {
  Observations all = calibration.observations;
  all.axis = trial.score.settings.axis;
  all.stripes.clear();
  std::vector<std::size_t> image_of;
  JointSolution solution = calibration.solution;
  solution.stripe_residual_px.clear();
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (!trial.stripes[i].found()) continue;
    all.stripes.push_back(view_of(*images[i], trial.stripes[i]));
    image_of.push_back(i);
    solution.stripe_residual_px.emplace_back(all.stripes.back().pixel.size(), 0.0);
  }
  std::vector<double> distances(images.size(), std::numeric_limits<double>::quiet_NaN());
  for (int laser = 0; laser < all.laser_count(); ++laser) {
    const auto plane = fit_plane(stripe_points_cam(all, solution, laser));
    for (std::size_t s = 0; s < all.stripes.size() && plane; ++s) {
      if (all.stripes[s].laser != laser) continue;
      const auto view = static_cast<std::size_t>(all.stripes[s].view);
      distances[image_of[s]] = stripe_rms_px(all, all.stripes[s], solution.camera,
                                             solution.T_cam_board[view], *plane, solution.bend_m);
    }
  }
  return distances;
}

double median_of_finite(const std::vector<double>& values) {
  std::vector<double> finite;
  for (const double value : values)
    if (std::isfinite(value)) finite.push_back(value);
  return finite.empty() ? std::numeric_limits<double>::infinity() : upper_median(finite);
}

// One bound for all trials: a way of reading that scatters more gets no more room, and none gets
// more than a calibration may have.
void judge(std::vector<SettingsTrial>& trials, const std::vector<const ImageResult*>& images,
           const CalibrationOptions& options, const Calibration& calibration) {
  std::vector<std::vector<double>> distances;
  double usual_px = std::numeric_limits<double>::infinity();
  for (const SettingsTrial& trial : trials) {
    distances.push_back(distances_px(trial, images, calibration));
    usual_px = std::min(usual_px, median_of_finite(distances.back()));
  }
  const double most_px = options.limits.most_stripe_rms_px *
                         std::max(1.0, calibration.observations.image_width / 640.0);
  const double bound_px = std::clamp(kStripeOutlier * usual_px, kLeastStripePx, most_px);
  for (std::size_t t = 0; t < trials.size(); ++t) {
    SettingsScore& score = trials[t].score;
    double squares = 0.0;
    for (std::size_t i = 0; i < images.size(); ++i) {
      score.stripes += trials[t].stripes[i].found() ? 1 : 0;
      if (!(distances[t][i] <= bound_px)) continue;
      ++score.on_plane;
      squares += distances[t][i] * distances[t][i];
    }
    score.rms_px = std::sqrt(squares / score.on_plane);  // NaN for none.
  }
}

double merit(const SettingsScore& score) {
  return score.on_plane > 0 ? score.on_plane / std::max(score.rms_px, kLeastRmsPx) : 0.0;
}

// The best of those that `counts` names, the better first impression where two are about as good;
// null where there is none.
template <typename Counts>
const SettingsTrial* best_of(const std::vector<SettingsTrial>& trials, const Counts& counts) {
  const SettingsTrial* best = nullptr;
  for (const SettingsTrial& trial : trials) {
    if (!counts(trial.score)) continue;
    if (best == nullptr || merit(trial.score) > kBetter * merit(best->score)) best = &trial;
  }
  return best;
}

void take(const SettingsTrial& chosen, const std::vector<ImageResult*>& lit,
          Calibration& calibration) {
  calibration.settings = chosen.score.settings;
  calibration.observations.axis = chosen.score.settings.axis;
  for (std::size_t i = 0; i < lit.size(); ++i) {
    ImageResult& result = *lit[i];
    result.stripe = chosen.stripes[i];
    result.stripe_reason = result.stripe.reason;
    if (!result.stripe.found()) continue;
    result.stripe_view = static_cast<int>(calibration.observations.stripes.size());
    calibration.observations.stripes.push_back(view_of(result, result.stripe));
  }
}

// The best way of reading single frames. Of what a scanner finds far less is wrong in a laser's own
// channel than in a difference of colours (docs/accuracy.md), though a board's plane may be read
// better from that: the own channel needs most of its stripes.
const SettingsTrial* best_for_single_frames(const std::vector<SettingsTrial>& trials,
                                            StripeAxis axis) {
  constexpr double kMost = 0.9;
  const auto is_single = [axis](const SettingsScore& score) {
    return !score.settings.subtract_off && score.settings.axis == axis && score.on_plane > 0;
  };
  const SettingsTrial* const best = best_of(trials, is_single);
  if (best == nullptr || !is_colour_difference(best->score.settings.channel)) return best;
  const SettingsTrial* const own = best_of(trials, [&](const SettingsScore& score) {
    const Channel channel = score.settings.channel;
    return is_single(score) && !is_colour_difference(channel) && channel != Channel::kGrey &&
           score.on_plane >= kMost * best->score.on_plane;
  });
  return own != nullptr ? own : best;
}

// The channel for single frames is the one that is best without the laser-off images; the one for
// differences is kept beside it where there are such images and it is another.
void choose_channels(const std::vector<SettingsTrial>& trials, const SettingsTrial& chosen,
                     const std::vector<ImageResult*>& lit, Calibration& calibration) {
  const StripeAxis axis = chosen.score.settings.axis;
  const SettingsTrial* const single = best_for_single_frames(trials, axis);
  const SettingsTrial* const difference = best_of(trials, [axis](const SettingsScore& score) {
    return score.settings.subtract_off && score.settings.axis == axis && score.on_plane > 0;
  });
  StriperModel& model = calibration.model;
  // Where no single image shows it, a scanner is to look for itself.
  const Channel unknown =
      chosen.score.settings.channel == Channel::kGrey ? Channel::kGrey : Channel::kAuto;
  model.channel = single != nullptr ? single->score.settings.channel : unknown;
  if (difference != nullptr && difference->score.settings.channel != model.channel)
    model.difference_channel = difference->score.settings.channel;
  if (single == nullptr || single == &chosen) return;
  for (std::size_t i = 0; i < lit.size(); ++i) lit[i]->single_frame = single->stripes[i];
}

SettingsRanking compared_settings_to_try(const std::vector<ImageResult*>& lit,
                                         const CalibrationOptions& options,
                                         const Calibration& calibration) {
  std::vector<LaserImage> some;
  const std::size_t step = std::max<std::size_t>(1, lit.size() / 6);
  for (std::size_t k = 0; k < lit.size(); k += step)
    some.push_back(laser_image(calibration, *lit[k]));
  return rank_settings(some, calibration.observations.board, calibration.solution.camera,
                       options.axis, options.channel);
}

}  // namespace

LaserImage laser_image(const Calibration& calibration, const ImageResult& result) {
  const bool is_pair = result.laser >= 0 && result.lit.name != result.image.name;
  const SessionImage& lit = result.laser >= 0 ? result.lit : result.image;
  LaserImage laser;
  laser.name = lit.name;
  laser.on = lit.load();
  if (is_pair) laser.off = result.image.load();
  laser.bit_depth = laser.on.depth() == CV_16U && lit.bit_depth <= 8 ? 16 : lit.bit_depth;
  laser.T_cam_board = calibration.solution.T_cam_board[static_cast<std::size_t>(result.view)];
  return laser;
}

std::vector<SettingsTrial> try_compared_settings(
    const std::vector<ExtractionSettings>& compared_settings,
    const std::vector<const ImageResult*>& images,
    const std::function<LaserImage(const ImageResult&)>& load, const CalibrationOptions& options,
    const Calibration& calibration) {
  std::vector<SettingsTrial> trials;
  trials.reserve(compared_settings.size());
  for (const ExtractionSettings& settings : compared_settings)
    trials.push_back({{settings}, std::vector<BoardStripe>(images.size())});
  std::mutex lock;
  std::size_t done = 0;
  for_each_index(images.size(), options.threads, [&](std::size_t i) {
    const LaserImage image = load(*images[i]);
    for (SettingsTrial& trial : trials) {
      ExtractionSettings settings = trial.score.settings;
      if (image.off.empty()) settings.subtract_off = false;
      trial.stripes[i] = find_board_stripe(image, calibration.observations.board,
                                           calibration.solution.camera, settings, options.noise);
    }
    const std::lock_guard guard(lock);
    report_progress(options, "finding stripes",
                    0.65 + 0.1 * static_cast<double>(++done) / static_cast<double>(images.size()));
  });
  judge(trials, images, options, calibration);
  return trials;
}

void find_stripes(const CalibrationInput& input, const CalibrationOptions& options,
                  Calibration& calibration) {
  std::vector<ImageResult*> lit;
  for (ImageResult& result : calibration.images)
    if (result.laser >= 0 && result.view >= 0) lit.push_back(&result);
  if (lit.empty())
    throw Error(ErrorKind::kUntrustworthy,
                "the board was found in none of the laser images: without its pose the stripe "
                "says nothing. Move the laser so that it leaves most corners free, or take pairs "
                "(laser off, then on)");
  report_progress(options, "looking how the stripe is seen best", 0.6);
  SettingsRanking compared_settings;
  try {
    compared_settings = compared_settings_to_try(lit, options, calibration);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kUntrustworthy) throw;
    refuse_swapped_lists(input, options, calibration, 0);
    throw;
  }
  const auto try_all = [&](const std::vector<ExtractionSettings>& some) {
    return try_compared_settings(
        some, {lit.begin(), lit.end()},
        [&](const ImageResult& one) { return laser_image(calibration, one); }, options,
        calibration);
  };
  const auto any = [](const SettingsScore&) { return true; };
  const auto is_found = [&lit](const SettingsScore& score) {
    return 2 * score.on_plane >= static_cast<int>(lit.size());
  };
  std::vector<SettingsTrial> trials = try_all(compared_settings.plausible);
  if (std::none_of(trials.begin(), trials.end(),
                   [&](const SettingsTrial& trial) { return is_found(trial.score); })) {
    for (SettingsTrial& trial : try_all(compared_settings.others))
      trials.push_back(std::move(trial));
  }
  const SettingsTrial& chosen = *best_of(trials, any);
  if (!is_found(chosen.score))
    refuse_swapped_lists(input, options, calibration, chosen.score.on_plane);
  take(chosen, lit, calibration);
  choose_channels(trials, chosen, lit, calibration);
  for (const SettingsTrial& trial : trials) calibration.compared_settings.push_back(trial.score);
  std::swap(calibration.compared_settings.front(),
            calibration.compared_settings[static_cast<std::size_t>(&chosen - trials.data())]);
}

}  // namespace striper::detail
