// SPDX-License-Identifier: Apache-2.0
// How fast the stripe is found: every size and depth of `striper bench`, and the allocations of a
// frame, which that cannot count.
#include <cstdio>

#include "bench/speed_table.hpp"
#include "bench/speed_text.hpp"
#include "support/allocation_counter.hpp"

int main() {
  striper::speed::SpeedOptions options;
  options.allocations = striper::testing::allocations_so_far;
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
