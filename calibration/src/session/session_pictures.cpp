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

// All pictures must come from one camera at one setting: the first one says how large they are.
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
          fmt::format("{}: the picture is {}x{}, but {} is {}x{}; all must come from one "
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
        fmt::format("{}: the picture is {}x{} and the given intrinsics are of {}x{}", first_name_,
                    size_.width, size_.height, camera.width(), camera.height()));
  }

  const CalibrationOptions& options_;
  std::mutex lock_;
  cv::Size size_;
  std::string first_name_;
};

// The picture that shows the board. Both of a pair are read: half of it is of no use.
cv::Mat load_checked(const PictureResult& picture, CommonSize& common) {
  cv::Mat image = picture.picture.load();
  common.check(picture.picture.name, image.size());
  if (picture.laser >= 0 && picture.lit.name != picture.picture.name)
    common.check(picture.lit.name, picture.lit.load().size());
  return image;
}

bool is_of_the_file(ErrorKind kind) {
  return kind == ErrorKind::kBadFile || kind == ErrorKind::kIo || kind == ErrorKind::kNotFound;
}

void find_board_of(PictureResult& picture, const Board& board, BoardSearch search,
                   CommonSize& common) {
  cv::Mat image;
  try {
    image = load_checked(picture, common);
  } catch (const Error& error) {
    if (!is_of_the_file(error.kind())) throw;
    picture.fault = picture.board_reason = error.what();
    return;
  }
  picture.board = find_board(image, board, search);
  picture.board_reason = picture.board.reason;
}

cv::Size find_all(const CalibrationInput& input, const CalibrationOptions& options,
                  Calibration& calibration) {
  CommonSize common(options);
  std::atomic<std::size_t> next{0};
  std::atomic<std::size_t> done{0};
  std::mutex lock;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t i = next++; i < calibration.pictures.size(); i = next++) {
      try {
        find_board_of(calibration.pictures[i], input.board,
                      options.like_opencv ? BoardSearch::kLikeOpenCv : BoardSearch::kThorough,
                      common);
        // Inside of the try: a caller may end the work by throwing from its progress.
        const std::lock_guard guard(lock);
        report_progress(
            options, "finding boards",
            0.5 * static_cast<double>(++done) / static_cast<double>(calibration.pictures.size()));
      } catch (...) {
        const std::lock_guard guard(lock);
        failure = std::current_exception();
        next = calibration.pictures.size();
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

// Which other board is in some of the pictures without the one that was given; empty for none.
std::string hint_of_another_board(const CalibrationInput& input, const Calibration& calibration) {
  constexpr int kGuesses = 3;
  int guesses = 0;
  for (const PictureResult& picture : calibration.pictures) {
    if (!picture.fault.empty() || picture.board.found) continue;
    if (guesses++ == kGuesses) break;
    const std::string size = guess_board_size(picture.picture.load(), input.board);
    if (size.empty() || size == to_string(input.board)) continue;
    return fmt::format("; a {} board is in {}: the size is given in inner corners, columns x rows",
                       size, picture.picture.name);
  }
  return {};
}

[[noreturn]] void refuse_without_boards(const CalibrationInput& input,
                                        const Calibration& calibration) {
  const bool is_any_read =
      std::any_of(calibration.pictures.begin(), calibration.pictures.end(),
                  [](const PictureResult& picture) { return picture.fault.empty(); });
  const std::string hint = hint_of_another_board(input, calibration);
  if (!is_any_read)
    throw Error(ErrorKind::kBadFile,
                fmt::format("none of {} pictures can be read; {}", calibration.pictures.size(),
                            calibration.pictures.front().fault));
  throw Error(ErrorKind::kUntrustworthy,
              fmt::format("the {} board was found in none of {} pictures ({}: {}){}",
                          to_string(input.board), calibration.pictures.size(),
                          calibration.pictures.front().picture.name,
                          calibration.pictures.front().board_reason, hint));
}

// A board that is larger than the given one holds it, and now and then it is found there: in few
// pictures, and as likely as not in different places.
void refuse_a_part_of_a_board(const CalibrationInput& input, const Calibration& calibration) {
  constexpr std::size_t kFewestViews = 3;  // As many as a camera is solved from.
  const std::size_t found = calibration.observations.views.size();
  if (found >= kFewestViews) return;
  const std::string hint = hint_of_another_board(input, calibration);
  if (hint.empty()) return;
  throw Error(ErrorKind::kUntrustworthy,
              fmt::format("the {} board was found in {} of {} pictures only{}",
                          to_string(input.board), found, calibration.pictures.size(), hint));
}

// A board printed by another program may have larger or smaller circles.
double median_dot_ratio(const Calibration& calibration) {
  std::vector<double> ratios;
  for (const PictureResult& picture : calibration.pictures)
    if (picture.view >= 0) ratios.push_back(picture.board.dot_ratio);
  return upper_median(ratios);
}

void collect_views(const CalibrationInput& input, cv::Size size, Calibration& calibration) {
  Observations& observations = calibration.observations;
  observations.board = input.board;
  observations.image_width = size.width;
  observations.image_height = size.height;
  std::map<std::string, int> view_of;  // A pose that several lasers share is one view.
  for (PictureResult& picture : calibration.pictures) {
    if (!picture.board.found) continue;
    const auto known = view_of.find(picture.picture.name);
    if (known != view_of.end()) {
      picture.view = known->second;
      continue;
    }
    CornerView view;
    view.name = picture.picture.name;
    for (std::size_t i = 0; i < picture.board.corners_px.size(); ++i) {
      if (!picture.board.reliable[i]) continue;
      view.point.push_back(static_cast<int>(i));
      view.pixel.push_back(picture.board.corners_px[i]);
    }
    if (view.point.size() < std::min<std::size_t>(kFewestCorners, static_cast<std::size_t>(
                                                                      input.board.point_count()))) {
      picture.board_reason = fmt::format("only {} of {} corners look like corners",
                                         view.point.size(), input.board.point_count());
      continue;
    }
    picture.view = static_cast<int>(observations.views.size());
    view_of[picture.picture.name] = picture.view;
    observations.views.push_back(std::move(view));
  }
  if (observations.views.empty()) refuse_without_boards(input, calibration);
  refuse_a_part_of_a_board(input, calibration);
  if (input.board.pattern == Board::Pattern::kCircles)
    observations.board.dot_ratio = median_dot_ratio(calibration);
}

}  // namespace

void list_pictures(const CalibrationInput& input, Calibration& calibration) {
  input.board.validate();
  std::map<std::string, bool> listed;
  for (std::size_t laser = 0; laser < input.lasers.size(); ++laser) {
    const LaserPictures& pictures = input.lasers[laser];
    if (!pictures.off.empty() && pictures.off.size() != pictures.on.size())
      throw Error(ErrorKind::kUsage,
                  fmt::format("laser {}: {} pictures with the laser off and {} with it on; pairs "
                              "need as many of each",
                              laser, pictures.off.size(), pictures.on.size()));
    for (std::size_t i = 0; i < pictures.on.size(); ++i) {
      PictureResult picture;
      picture.laser = static_cast<int>(laser);
      picture.lit = pictures.on[i];
      picture.picture = pictures.off.empty() ? pictures.on[i] : pictures.off[i];
      listed[picture.picture.name] = true;
      calibration.pictures.push_back(std::move(picture));
    }
  }
  for (const SessionPicture& picture : input.boards) {
    if (listed[picture.name]) continue;
    listed[picture.name] = true;
    PictureResult board;
    board.picture = picture;
    calibration.pictures.push_back(std::move(board));
  }
  if (calibration.pictures.empty())
    throw Error(ErrorKind::kUsage, "there is no picture to calibrate from");
}

void find_boards(const CalibrationInput& input, const CalibrationOptions& options,
                 Calibration& calibration) {
  const cv::Size size = find_all(input, options, calibration);
  collect_views(input, size, calibration);
}

}  // namespace striper::detail
