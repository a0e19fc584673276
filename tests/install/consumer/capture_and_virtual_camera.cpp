// SPDX-License-Identifier: Apache-2.0
// Serves a scene as a GigE Vision camera and takes a frame from it, over the network of this
// machine.
#include <chrono>
#include <cstdio>
#include <exception>

#include <unistd.h>

#include <striper/capture/open_source.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/virtual_camera/virtual_camera.hpp>

int main(int, char** argv) try {
  striper::VirtualCameraOptions options;
  options.address = "127.15." + std::to_string(getpid() % 250) + ".1";
  const striper::VirtualCamera camera(striper::make_virtual_scene(striper::load_scene(argv[1])),
                                      options);
  const auto source = striper::open_source("gige:" + options.address);
  source->start();
  striper::Frame frame;
  const striper::NextStatus status = source->next(frame, std::chrono::seconds(5));
  std::printf("%d x %d pixels of %s\n", frame.image.cols, frame.image.rows,
              source->info().description.c_str());
  return status == striper::NextStatus::kFrame && !frame.image.empty() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
