// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>

#include "session/calibration_steps.hpp"

namespace striper::detail {
namespace {

constexpr std::size_t kFewestCorners = 12;

// All images must come from one camera at one setting: the first one says how large they are.
class CommonSize {
 public:
  explicit CommonSize(const CalibrationOptions& options) : options_(options) {}

  cv::Size size() const noexcept { return size_; }

  void check(const std::string& name, cv::Size size) {
    const std::lock_guard guard(lock_);
    if (size_.empty()) {
      size_ = size;
      first_name_ = name;
      check_known_camera();
    }
    if (size != size_)
      throw Error(
          ErrorKind::kBadValue,
          fmt::format("{}: the image is {}x{}, but {} is {}x{}; all must come from one "
                      "camera at one setting",
                      name, size.width, size.height, first_name_, size_.width, size_.height));
  }

 private:
  void check_known_camera() const {
    if (!options_.known_camera) return;
    const CameraModel& camera = options_.known_camera->camera;
    if (camera.width() == size_.width && camera.height() == size_.height) return;
    throw Error(
        ErrorKind::kBadValue,
        fmt::format("{}: the image is {}x{} and the given intrinsics are of {}x{}", first_name_,
                    size_.width, size_.height, camera.width(), camera.height()));
  }

  const CalibrationOptions& options_;
  std::mutex lock_;
  cv::Size size_;
  std::string first_name_;
};

// The image that shows the board. Both of a pair are read: half of it is of no use.
cv::Mat load_checked(const ImageResult& result, CommonSize& common) {
  cv::Mat image = result.image.load();
  common.check(result.image.name, image.size());
  if (result.laser >= 0 && result.lit.name != result.image.name)
    common.check(result.lit.name, result.lit.load().size());
  return image;
}

bool is_of_the_file(ErrorKind kind) {
  return kind == ErrorKind::kBadFile || kind == ErrorKind::kIo || kind == ErrorKind::kNotFound;
}

void find_board_of(ImageResult& result, const Board& board, BoardSearch search,
                   CommonSize& common) {
  cv::Mat image;
  try {
    image = load_checked(result, common);
  } catch (const Error& error) {
    if (!is_of_the_file(error.kind())) throw;
    result.fault = result.board_reason = error.what();
    return;
  }
  result.board = find_board(image, board, search);
  result.board_reason = result.board.reason;
}

cv::Size find_all(const CalibrationInput& input, const CalibrationOptions& options,
                  Calibration& calibration) {
  CommonSize common(options);
  std::atomic<std::size_t> next{0};
  std::atomic<std::size_t> done{0};
  std::mutex lock;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t i = next++; i < calibration.images.size(); i = next++) {
      try {
        find_board_of(calibration.images[i], input.board,
                      options.like_opencv ? BoardSearch::kLikeOpenCv : BoardSearch::kThorough,
                      common);
        // Inside of the try: a caller may end the work by throwing from its progress.
        const std::lock_guard guard(lock);
        report_progress(
            options, "finding boards",
            0.5 * static_cast<double>(++done) / static_cast<double>(calibration.images.size()));
      } catch (...) {
        const std::lock_guard guard(lock);
        failure = std::current_exception();
        next = calibration.images.size();
      }
    }
  };
  std::vector<std::thread> others;
  for (int t = 1; t < options.threads; ++t) others.emplace_back(work);
  work();
  for (std::thread& thread : others) thread.join();
  if (failure) std::rethrow_exception(failure);
  return common.size();
}

// Which other board is in some of the images without the one that was given; empty for none.
std::string hint_of_another_board(const CalibrationInput& input, const Calibration& calibration) {
  constexpr int kGuesses = 3;
  int guesses = 0;
  for (const ImageResult& result : calibration.images) {
    if (!result.fault.empty() || result.board.found) continue;
    if (guesses++ == kGuesses) break;
    const std::string size = guess_board_size(result.image.load(), input.board);
    if (size.empty() || size == to_string(input.board)) continue;
    return fmt::format("; a {} board is in {}: the size is given in inner corners, columns x rows",
                       size, result.image.name);
  }
  return {};
}

[[noreturn]] void refuse_without_boards(const CalibrationInput& input,
                                        const Calibration& calibration) {
  const bool is_any_read =
      std::any_of(calibration.images.begin(), calibration.images.end(),
                  [](const ImageResult& result) { return result.fault.empty(); });
  const std::string hint = hint_of_another_board(input, calibration);
  if (!is_any_read)
    throw Error(ErrorKind::kBadFile,
                fmt::format("none of {} images can be read; {}", calibration.images.size(),
                            calibration.images.front().fault));
  throw Error(
      ErrorKind::kUntrustworthy,
      fmt::format("the {} board was found in none of {} images ({}: {}){}", to_string(input.board),
                  calibration.images.size(), calibration.images.front().image.name,
                  calibration.images.front().board_reason, hint));
}

// A board that is larger than the given one holds it, and now and then it is found there: in few
// images, and as likely as not in different places.
void refuse_a_part_of_a_board(const CalibrationInput& input, const Calibration& calibration) {
  constexpr std::size_t kFewestViews = 3;  // As many as a camera is solved from.
  const std::size_t found = calibration.observations.views.size();
  if (found >= kFewestViews) return;
  const std::string hint = hint_of_another_board(input, calibration);
  if (hint.empty()) return;
  throw Error(ErrorKind::kUntrustworthy,
              fmt::format("the {} board was found in {} of {} images only{}",
                          to_string(input.board), found, calibration.images.size(), hint));
}

// A board printed by another program may have larger or smaller circles.
double median_dot_ratio(const Calibration& calibration) {
  std::vector<double> ratios;
  for (const ImageResult& result : calibration.images)
    if (result.view >= 0) ratios.push_back(result.board.dot_ratio);
  return upper_median(ratios);
}

void collect_views(const CalibrationInput& input, cv::Size size, Calibration& calibration) {
  Observations& observations = calibration.observations;
  observations.board = input.board;
  observations.image_width = size.width;
  observations.image_height = size.height;
  std::map<std::string, int> view_of;  // A pose that several lasers share is one view.
  for (ImageResult& result : calibration.images) {
    if (!result.board.found) continue;
    const auto known = view_of.find(result.image.name);
    if (known != view_of.end()) {
      result.view = known->second;
      continue;
    }
    CornerView view;
    view.name = result.image.name;
    for (std::size_t i = 0; i < result.board.corners_px.size(); ++i) {
      if (!result.board.reliable[i]) continue;
      view.point.push_back(static_cast<int>(i));
      view.pixel.push_back(result.board.corners_px[i]);
    }
    if (view.point.size() < std::min<std::size_t>(kFewestCorners, static_cast<std::size_t>(
                                                                      input.board.point_count()))) {
      result.board_reason = fmt::format("only {} of {} corners look like corners",
                                        view.point.size(), input.board.point_count());
      continue;
    }
    result.view = static_cast<int>(observations.views.size());
    view_of[result.image.name] = result.view;
    observations.views.push_back(std::move(view));
  }
  if (observations.views.empty()) refuse_without_boards(input, calibration);
  refuse_a_part_of_a_board(input, calibration);
  if (input.board.pattern == Board::Pattern::kCircles)
    observations.board.dot_ratio = median_dot_ratio(calibration);
}

}  // namespace

void list_images(const CalibrationInput& input, Calibration& calibration) {
  input.board.validate();
  std::map<std::string, bool> listed;
  for (std::size_t laser = 0; laser < input.lasers.size(); ++laser) {
    const LaserImages& images = input.lasers[laser];
    if (!images.off.empty() && images.off.size() != images.on.size())
      throw Error(ErrorKind::kUsage,
                  fmt::format("laser {}: {} images with the laser off and {} with it on; pairs "
                              "need as many of each",
                              laser, images.off.size(), images.on.size()));
    for (std::size_t i = 0; i < images.on.size(); ++i) {
      ImageResult result;
      result.laser = static_cast<int>(laser);
      result.lit = images.on[i];
      result.image = images.off.empty() ? images.on[i] : images.off[i];
      listed[result.image.name] = true;
      calibration.images.push_back(std::move(result));
    }
  }
  for (const SessionImage& image : input.boards) {
    if (listed[image.name]) continue;
    listed[image.name] = true;
    ImageResult board;
    board.image = image;
    calibration.images.push_back(std::move(board));
  }
  if (calibration.images.empty())
    throw Error(ErrorKind::kUsage, "there is no image to calibrate from");
}

void find_boards(const CalibrationInput& input, const CalibrationOptions& options,
                 Calibration& calibration) {
  const cv::Size size = find_all(input, options, calibration);
  collect_views(input, size, calibration);
}

}  // namespace striper::detail
