// SPDX-License-Identifier: Apache-2.0
// Proves that what is listed can be opened by its address, on a machine with whatever cameras it
// has (often none). What a listing says of a device is in v4l2/devices_test.cpp.
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/capture/list_cameras.hpp>
#include <striper/capture/source_uri.hpp>

namespace striper {
namespace {

TEST(ListCameras, GivesEachCameraOnceByAnAddressOfItsKind) {
  std::set<std::string> seen;
  for (const CameraListing& camera : list_cameras()) {
    EXPECT_TRUE(seen.insert(camera.uri).second) << camera.uri << " is listed twice";
    EXPECT_EQ(SourceUri::parse(camera.uri).scheme(), camera.kind);
    EXPECT_FALSE(camera.name.empty()) << camera.uri;
    for (const std::string& other : camera.other_uris)
      EXPECT_EQ(SourceUri::parse(other).scheme(), camera.kind) << other;
  }
}

}  // namespace
}  // namespace striper
