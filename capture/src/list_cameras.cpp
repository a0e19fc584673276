// SPDX-License-Identifier: Apache-2.0
#include <iterator>
#include <utility>

#include <striper/capture/list_cameras.hpp>

#ifdef STRIPER_WITH_V4L2
#include <striper/v4l2/v4l2_devices.hpp>
#endif
#ifdef STRIPER_HAS_ARAVIS
#include <striper/gige/gige_network.hpp>
#endif

namespace striper {

#ifdef STRIPER_HAS_ARAVIS
namespace {

CameraListing to_camera(GigeListing gige) {
  CameraListing listing;
  listing.kind = gige.uri.substr(0, gige.uri.find(':'));
  listing.name = gige.maker + " " + gige.model;
  listing.driver = gige.interface.empty() ? gige.protocol : gige.protocol + " on " + gige.interface;
  if (!gige.user_name.empty()) listing.other_uris.push_back("gige:" + gige.user_name);
  if (!gige.mac.empty()) {
    listing.other_uris.push_back("gige:" + gige.address);
    listing.other_uris.push_back("gige:" + gige.mac);
  }
  if (gige.access == "other subnet") {
    listing.trouble = "its address is of another subnet than the interface that it answers on";
  } else if (gige.access.starts_with("held")) {
    listing.trouble = gige.access;
  }
  listing.uri = std::move(gige.uri);
  listing.serial = std::move(gige.serial);
  listing.access = std::move(gige.access);
  listing.address = std::move(gige.address);
  return listing;
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
  for (GigeListing& camera : list_gige_cameras()) all.push_back(to_camera(std::move(camera)));
#endif
  return all;
}

}  // namespace striper
