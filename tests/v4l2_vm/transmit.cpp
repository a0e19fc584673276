// SPDX-License-Identifier: Apache-2.0
// Sends grey pictures through the virtual driver's output as a television signal: a camera for
// programs that are tried from outside.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/v4l2/televised_scene.hpp"
#include "v4l2_vm/vivid.hpp"

namespace {

using striper::testing::Television;

constexpr const char* kUsage =
    "usage: vivid_transmit WAY SECONDS PICTURE.png...\n"
    "Sends each picture, in the middle of a black one of the standard's size, for so many "
    "seconds.\n"
    "WAY is one of:";

Television way_named(const std::string& name) {
  std::string known;
  for (const Television& way : striper::testing::ways_of_television()) {
    if (way.name == name) return way;
    known += " " + way.name;
  }
  throw std::runtime_error(kUsage + known);
}

cv::Mat on_canvas(const std::string& path, const Television& way) {
  const cv::Mat picture = cv::imread(path, cv::IMREAD_UNCHANGED);
  cv::Mat canvas(way.lines(), striper::testing::Broadcast().width, CV_8UC1, cv::Scalar(0));
  if (picture.type() != CV_8UC1 || picture.cols > canvas.cols || picture.rows > canvas.rows)
    throw std::runtime_error(fmt::format("{} is no grey picture of 8 bits of at most {}x{}", path,
                                         canvas.cols, canvas.rows));
  const cv::Rect middle((canvas.cols - picture.cols) / 2, (canvas.rows - picture.rows) / 2,
                        picture.cols, picture.rows);
  picture.copyTo(canvas(middle));
  if (way.code == V4L2_PIX_FMT_Y16) canvas.convertTo(canvas, CV_16U, 256.0);
  return canvas;
}

void transmit(const Television& way, double seconds, const std::vector<std::string>& paths) {
  striper::testing::Broadcast broadcast;
  broadcast.standard = way.standard;
  broadcast.code = way.code;
  broadcast.field = way.field;
  broadcast.height = way.lines();
  const auto buffers = [&](const std::string& path) {
    return striper::testing::buffers_of(on_canvas(path, way), way);
  };
  striper::testing::Transmitter transmitter(striper::testing::output_path(), broadcast,
                                            buffers(paths.front()));
  std::puts("sending");
  for (const std::string& path : paths) {
    transmitter.change(buffers(path));
    std::puts(path.c_str());
    std::fflush(stdout);
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Television way = way_named(argc > 3 ? argv[1] : "");
    transmit(way, std::atof(argv[2]), {argv + 3, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vivid_transmit: %s\n", error.what());
    return 2;
  }
  return 0;
}
