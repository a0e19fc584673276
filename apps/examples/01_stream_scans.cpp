// SPDX-License-Identifier: Apache-2.0
// Streams scans from any source: 01_stream_scans SOURCE MODEL
#include <iostream>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/pipeline/scanner.hpp>

void print(striper::ScanSpan scans) {
  for (const striper::PolarScan& scan : scans) {
    for (const striper::Return& point : scan.returns) {
      if (point.status != striper::ReturnStatus::kOk) continue;
      std::cout << point.bearing_rad << ' ' << point.range_m << " +- " << point.sigma_m << '\n';
    }
  }
}

void stream(const char* source_name, const char* model_name) {
  const auto source = striper::open_source(source_name);  // "v4l2:/dev/video0", ...
  striper::Scanner scanner(striper::load_model(model_name), source->info());
  source->start();
  striper::Frame frame;
  // Until the source ends, or a camera is silent for a second.
  while (source->next(frame, std::chrono::seconds(1)) == striper::NextStatus::kFrame) {
    print(scanner.process(frame));
  }
  print(scanner.finish());
}

int main(int argc, char** argv) try {
  if (argc != 3)
    throw striper::Error(striper::ErrorKind::kUsage, "usage: 01_stream_scans SOURCE MODEL");
  stream(argv[1], argv[2]);
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
