// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include <striper/board/observations.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

[[noreturn]] void refuse(const std::string& view, const std::string& what) {
  throw Error(ErrorKind::kBadValue, fmt::format("observations of '{}': {}", view, what));
}

void check(const CornerView& view, const Board& board) {
  if (view.point.size() != view.pixel.size())
    refuse(view.name, fmt::format("{} board points and {} pixels; expected as many",
                                  view.point.size(), view.pixel.size()));
  for (const int point : view.point)
    if (point < 0 || point >= board.point_count())
      refuse(view.name,
             fmt::format("board point {}; expected 0 to {}", point, board.point_count() - 1));
  for (const Eigen::Vector2d& pixel : view.pixel)
    if (!pixel.allFinite()) refuse(view.name, "a corner that is not finite");
}

void check(const StripeView& stripe, std::size_t view_count) {
  if (stripe.view < 0 || static_cast<std::size_t>(stripe.view) >= view_count)
    refuse(stripe.name, fmt::format("view {}; expected 0 to {}", stripe.view, view_count));
  if (stripe.laser < 0) refuse(stripe.name, fmt::format("laser {}", stripe.laser));
  if (stripe.pixel.size() != stripe.sigma_px.size())
    refuse(stripe.name, "as many sigmas as stripe points were expected");
  for (const double sigma : stripe.sigma_px)
    if (!(sigma > 0.0)) refuse(stripe.name, fmt::format("a stripe sigma of {} px", sigma));
  if (!(stripe.thickness_px >= 0.0 && stripe.width_px >= stripe.thickness_px))
    refuse(stripe.name,
           fmt::format("a stripe {} px wide, {} px of it the laser's; expected no less "
                       "than 0 and no more than the whole",
                       stripe.width_px, stripe.thickness_px));
}

}  // namespace

int Observations::laser_count() const noexcept {
  int count = 0;
  for (const StripeView& stripe : stripes) count = std::max(count, stripe.laser + 1);
  return count;
}

Observations Observations::subset(const std::vector<int>& view_indices) const {
  Observations some;
  some.board = board;
  some.image_width = image_width;
  some.image_height = image_height;
  some.axis = axis;
  std::vector<int> new_index(views.size(), -1);
  for (const int index : view_indices) {
    new_index[static_cast<std::size_t>(index)] = static_cast<int>(some.views.size());
    some.views.push_back(views[static_cast<std::size_t>(index)]);
  }
  for (const StripeView& stripe : stripes) {
    const int view = new_index[static_cast<std::size_t>(stripe.view)];
    if (view < 0) continue;
    some.stripes.push_back(stripe);
    some.stripes.back().view = view;
  }
  return some;
}

void Observations::validate() const {
  board.validate();
  if (image_width <= 0 || image_height <= 0)
    throw Error(
        ErrorKind::kBadValue,
        fmt::format("observations: image size {}x{}; expected above 0", image_width, image_height));
  for (const CornerView& view : views) check(view, board);
  for (const StripeView& stripe : stripes) check(stripe, views.size());
}

}  // namespace striper
