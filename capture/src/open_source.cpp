// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <fmt/format.h>

#include <striper/capture/open_source.hpp>
#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/images/image_source.hpp>
#include <striper/recording/recording_source.hpp>
#include <striper/simulator/simulated_source.hpp>
#include <striper/v4l2/v4l2_source.hpp>
#ifdef STRIPER_HAS_ARAVIS
#include <striper/gige/gige_source.hpp>
#endif

namespace striper {
namespace {

// What every source is built from when it is opened by its address.
template <typename Options>
Options options_of(SourceUri uri, const EventPort& events) {
  Options options = Options::from_uri(std::move(uri));
  options.events = events;
  return options;
}

}  // namespace

std::unique_ptr<FrameSource> open_source(std::string_view uri_text, const EventPort& events) {
  SourceUri uri = SourceUri::parse(uri_text);
  if (uri.scheme() == "images") {
    return std::make_unique<ImageSource>(options_of<ImageOptions>(std::move(uri), events));
  }
  if (uri.scheme() == "mcap") {
    return std::make_unique<RecordingSource>(options_of<RecordingOptions>(std::move(uri), events));
  }
  if (uri.scheme() == "sim") return SimulatedSource::open(std::move(uri));
#ifdef STRIPER_WITH_V4L2
  if (uri.scheme() == "v4l2") {
    return open_v4l2(options_of<V4l2Options>(std::move(uri), events));
  }
#endif
#ifdef STRIPER_HAS_ARAVIS
  if (uri.scheme() == "gige" || uri.scheme() == "u3v") {
    return std::make_unique<GigeSource>(options_of<GigeOptions>(std::move(uri), events));
  }
#endif
  throw Error(
      ErrorKind::kUnsupported,
      fmt::format("source '{}': this build has no backend for {}:", uri_text, uri.scheme()));
}

}  // namespace striper
