// SPDX-License-Identifier: Apache-2.0
// Takes a frame from a source that it knows by its address alone.
#include <chrono>
#include <cstdio>
#include <exception>
#include <string>

#include <striper/capture/open_source.hpp>

int main(int, char** argv) try {
  const auto source = striper::open_source(std::string("sim:") + argv[1]);
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
