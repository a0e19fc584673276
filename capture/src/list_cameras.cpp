// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <iterator>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <striper/capture/list_cameras.hpp>

#ifdef STRIPER_WITH_V4L2
#include <striper/v4l2/v4l2_devices.hpp>
#endif
#ifdef STRIPER_HAS_ARAVIS
#include "gige/gvcp_client.hpp"
#endif

namespace striper {

#ifdef STRIPER_HAS_ARAVIS
namespace {

std::string dotted(std::uint32_t address) {
  return fmt::format("{}.{}.{}.{}", address >> 24, address >> 16 & 255, address >> 8 & 255,
                     address & 255);
}

std::vector<CameraListing> list_gige_cameras() {
  constexpr std::chrono::milliseconds kAnswerWithin{500};
  std::vector<CameraListing> listings;
  for (const detail::GvcpDevice& device : detail::discover(kAnswerWithin)) {
    CameraListing listing;
    listing.uri = "gige:" + (device.serial.empty() ? dotted(device.address) : device.serial);
    listing.kind = "gige";
    listing.name = fmt::format("{} {}", device.manufacturer, device.model);
    listing.driver = device.interface_name;
    listing.address = dotted(device.address);
    listing.other_uris.push_back("gige:" + dotted(device.address));
    if (!device.is_reachable())
      listing.trouble = "its address is of another subnet than the interface that it answers on";
    listings.push_back(std::move(listing));
  }
  return listings;
}

}  // namespace
#endif

std::vector<CameraListing> list_cameras() {
  std::vector<CameraListing> all;
  [[maybe_unused]] const auto append = [&](std::vector<CameraListing> some) {
    std::move(some.begin(), some.end(), std::back_inserter(all));
  };
#ifdef STRIPER_WITH_V4L2
  append(list_v4l2_cameras());
#endif
#ifdef STRIPER_HAS_ARAVIS
  append(list_gige_cameras());
#endif
  return all;
}

}  // namespace striper
