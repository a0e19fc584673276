// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <striper/model/source_fit.hpp>

namespace striper {

std::string why_not_of_source(const StriperModel& model, const SourceInfo& source) {
  const cv::Size camera(model.camera.width(), model.camera.height());
  if (source.sensor_size.empty() || source.sensor_size == camera) return {};
  return fmt::format("is of a camera of {}x{} pixels, but source '{}' has {}x{}", camera.width,
                     camera.height, source.uri, source.sensor_size.width,
                     source.sensor_size.height);
}

}  // namespace striper
