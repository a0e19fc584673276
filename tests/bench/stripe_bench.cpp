// SPDX-License-Identifier: Apache-2.0
// How fast the stripe is found: every size and depth of `striper bench`, beside that what of `fast`
// reads and fits pixels, and the allocations of a frame, which that cannot count.
#include <cmath>
#include <cstdio>

#include "bench/speed_table.hpp"
#include "bench/speed_text.hpp"
#include "stripe/candidates/block_maxima.hpp"
#include "stripe/candidates/peak_list.hpp"
#include "stripe/profile/profile_plan.hpp"
#include "support/allocation_counter.hpp"

namespace {

using namespace striper;
using detail::BlockMaxima;

// Of `fast`: the brightest place of each column, background, matched filter, log-parabola and its
// error, for a stripe of the image's width. Without what judges and learns: rivals, confidence,
// noise, width.
class BrightestPeaks {
 public:
  void find(const LitFrame& frame) {
    blocks_.find(frame, StripeAxis::kColumns);
    blocks_.rank(BlockMaxima::kFirst);
    const auto count = static_cast<std::size_t>(blocks_.lines());
    peaks_.make_room(count);
    peaks_.seeds.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      peaks_.seeds[i] = {static_cast<std::int32_t>(i), blocks_.best_across()[i]};
    }
    measure_profiles(images_of(frame), plan_of(frame), peaks_.seeds.data(), static_cast<int>(count),
                     peaks_.measurements());
  }

 private:
  static detail::ProfileImages images_of(const LitFrame& frame) {
    detail::ProfileImages images;
    images.lit = frame.lit.data;
    images.lit_steps = {1, static_cast<std::ptrdiff_t>(frame.lit.step1())};
    images.is_16_bit = frame.lit.depth() == CV_16U;
    images.length = frame.lit.rows;
    images.full_scale_dn = frame.full_scale_dn;
    return images;
  }

  static detail::ProfilePlan plan_of(const LitFrame& frame) {
    const double scale = frame.lit.depth() == CV_16U ? 16.0 : 1.0;
    detail::PlanNoise noise;
    noise.model.read_noise_dn = 2.0 * scale;
    const detail::WidthModel width{std::sqrt(1.5 * 1.5 + 1.0 / 12.0), 0.0, 0.0, 150.0 * scale};
    return detail::plan_profile(width, noise, false, detail::BackgroundReach::kUsual);
  }

  BlockMaxima blocks_;
  detail::PeakList peaks_;
};

}  // namespace

int main() {
  BrightestPeaks peaks;
  striper::speed::SpeedOptions options;
  options.allocations = striper::testing::allocations_so_far;
  options.parts_of_fast.push_back(
      {"brightest peaks, measured", [&](const LitFrame& frame) { peaks.find(frame); }});
  std::printf("instruction set: %s\n", striper::speed::instruction_set().c_str());
  for (const int bits : {8, 16}) {
    for (const cv::Size size : {cv::Size(640, 480), cv::Size(2048, 1088), cv::Size(4096, 3000)}) {
      const auto table = striper::speed::measure_speed(size, bits, options);
      std::printf("\n%s", striper::speed::to_text(table).c_str());
      std::fflush(stdout);
    }
  }
  return 0;
}
