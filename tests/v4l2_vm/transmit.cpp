// SPDX-License-Identifier: Apache-2.0
// Sends grey pictures through the virtual driver's output as an NTSC signal, over and over: a
// camera for programs that are tried from outside.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <thread>
#include <utility>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "v4l2_vm/vivid.hpp"

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fputs("usage: vivid_transmit SECONDS PICTURE.png...\n", stderr);
    return 2;
  }
  try {
    std::vector<std::vector<std::uint8_t>> pictures;
    for (int at = 2; at < argc; ++at) {
      const cv::Mat image = cv::imread(argv[at], cv::IMREAD_UNCHANGED);
      if (image.type() != CV_8UC1 || image.size() != cv::Size(720, 480) || !image.isContinuous()) {
        std::fprintf(stderr, "vivid_transmit: %s is not 720x480 grey of 8 bits\n", argv[at]);
        return 1;
      }
      pictures.emplace_back(image.datastart, image.dataend);
    }
    const striper::testing::Transmitter transmitter(striper::testing::output_path(), {},
                                                    std::move(pictures));
    std::puts("sending");
    std::fflush(stdout);
    std::this_thread::sleep_for(std::chrono::seconds(std::atoi(argv[1])));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vivid_transmit: %s\n", error.what());
    return 1;
  }
  return 0;
}
