// SPDX-License-Identifier: Apache-2.0
// scan_rate SESSION SECONDS: scans a second of a session's frames in memory, the best of five
// parts; what Python is compared with.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <striper/capture/open_source.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/pipeline/scanner.hpp>

int main(int argc, char** argv) {
  using Clock = std::chrono::steady_clock;
  if (argc != 3) return 2;
  const std::string session = argv[1];
  const double part_s = std::atof(argv[2]) / 5.0;
  const auto source = striper::open_source("images:" + session + "?laser=0");
  striper::ScannerOptions options =
      striper::ScannerOptions::for_model(striper::load_model(session + "/model.yaml"));
  options.ambient.pattern = source->info().pattern;
  striper::Scanner scanner(striper::load_model(session + "/model.yaml"), options);
  source->start();
  std::vector<striper::Frame> frames(1);
  while (source->next(frames.back(), std::chrono::seconds(1)) == striper::NextStatus::kFrame) {
    frames.emplace_back();
  }
  frames.pop_back();
  double best = 0.0;
  for (int part = 0; part < 6; ++part) {  // The first warms up.
    std::size_t count = 0;
    const Clock::time_point begin = Clock::now();
    std::chrono::duration<double> taken{};
    while ((taken = Clock::now() - begin).count() < part_s) {
      for (const striper::Frame& frame : frames) count += scanner.process(frame).size();
    }
    if (part > 0) best = std::max(best, static_cast<double>(count) / taken.count());
  }
  std::printf("%.1f\n", best);
}
