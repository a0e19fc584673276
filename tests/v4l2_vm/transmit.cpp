// SPDX-License-Identifier: Apache-2.0
// Sends grey images through the virtual driver's output as a television signal: a camera for
// programs that are tried from outside.
#include <cstdio>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/v4l2/interlaced_scene.hpp"
#include "v4l2_vm/vivid.hpp"

namespace {

using striper::testing::Broadcast;
using striper::testing::Television;
using striper::testing::Transmitter;

constexpr const char* kUsage =
    "usage: vivid_transmit WAY <PATHS\n"
    "Sends the image file whose path was read last, in the middle of a black image of the\n"
    "standard's size, until the input ends. Prints each path when its image is on its way. WAY is "
    "one of:";

Television way_named(const std::string& name) {
  std::string known;
  for (const Television& way : striper::testing::ways_of_television()) {
    if (way.name == name) return way;
    known += " " + way.name;
  }
  throw std::runtime_error(kUsage + known);
}

Broadcast broadcast(const Television& way) {
  Broadcast sent;
  sent.standard = way.standard;
  sent.code = way.code;
  sent.field = way.field;
  sent.height = way.lines();
  return sent;
}

std::vector<std::vector<std::uint8_t>> buffers(const std::string& path, const Television& way) {
  const cv::Mat image = cv::imread(path, cv::IMREAD_UNCHANGED);
  cv::Mat canvas(way.lines(), Broadcast().width, CV_8UC1, cv::Scalar(0));
  if (image.type() != CV_8UC1 || image.cols > canvas.cols || image.rows > canvas.rows) {
    throw std::runtime_error(fmt::format("{} is no grey image of 8 bits of at most {}x{}", path,
                                         canvas.cols, canvas.rows));
  }
  const cv::Rect middle((canvas.cols - image.cols) / 2, (canvas.rows - image.rows) / 2, image.cols,
                        image.rows);
  image.copyTo(canvas(middle));
  if (way.code == V4L2_PIX_FMT_Y16) canvas.convertTo(canvas, CV_16U, 256.0);
  return striper::testing::buffers_of(canvas, way);
}

void transmit(const Television& way) {
  std::optional<Transmitter> transmitter;
  for (std::string path; std::getline(std::cin, path);) {
    if (transmitter) {
      transmitter->change(buffers(path, way));
    } else {
      transmitter.emplace(striper::testing::output_path(), broadcast(way), buffers(path, way));
    }
    std::cout << path << std::endl;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    transmit(way_named(argc == 2 ? argv[1] : ""));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vivid_transmit: %s\n", error.what());
    return 2;
  }
  return 0;
}
