// SPDX-License-Identifier: Apache-2.0
// Streams scans from any source: 01_stream_scans SOURCE MODEL
#include <iostream>
#include <memory>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/scans/open_scans.hpp>

void stream(const char* source_name, const char* model_name) {
  const auto model = std::make_shared<const striper::StriperModel>(striper::load_model(model_name));
  const auto scans = striper::open_scans(source_name, model);  // "v4l2:/dev/video0", ...
  // Until the source ends; a silent camera is waited for.
  for (const striper::PolarScan& scan : *scans) {
    for (const striper::Return& point : scan.ok()) {
      std::cout << point.bearing_rad << ' ' << point.range_m << " +- " << point.sigma_m << '\n';
    }
  }
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
