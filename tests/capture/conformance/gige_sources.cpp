// SPDX-License-Identifier: Apache-2.0
// Proves that the GigE Vision source keeps the promises of a source, with images used in place
// and unpacked ones, a region, and a laser that is switched by the camera and by the host: over
// real packets on loopback, from the virtual camera.
#include <memory>

#include "capture/conformance/frame_source_conformance.hpp"
#include "capture/gige/virtual_striper.hpp"

namespace striper::testing {
namespace {

/// A source that keeps its camera running beside it.
class SourceWithCamera : public FrameSource {
 public:
  SourceWithCamera(std::shared_ptr<VirtualStriper> striper, const std::string& query)
      : striper_(std::move(striper)), source_(striper_->open(query)) {}

  SourceInfo info() const override { return source_->info(); }
  void start() override { source_->start(); }
  NextStatus next(Frame& frame, std::chrono::milliseconds timeout) override {
    return source_->next(frame, timeout);
  }
  void stop() override { source_->stop(); }
  SourceStatistics statistics() const override { return source_->statistics(); }
  Controls& controls() override { return source_->controls(); }

 private:
  std::shared_ptr<VirtualStriper> striper_;
  std::unique_ptr<GigeSource> source_;
};

SourceUnderTest virtual_camera(const std::string& name, int bit_depth, const std::string& query) {
  auto shared = std::make_shared<std::weak_ptr<VirtualStriper>>();
  const auto open = [=] {
    std::shared_ptr<VirtualStriper> striper = shared->lock();
    if (!striper) {
      striper = std::make_shared<VirtualStriper>(
          std::make_shared<PatternScene>(cv::Size(160, 120), bit_depth, 100.0));
      *shared = striper;
    }
    return std::make_unique<SourceWithCamera>(striper, query);
  };
  return {name, open, false};
}

INSTANTIATE_TEST_SUITE_P(
    Gige, FrameSourceConformance,
    ::testing::Values(virtual_camera("mono8", 8, "fps=100"),
                      virtual_camera("region", 8, "fps=100&roi=16,8,64,32"),
                      virtual_camera("binned", 8, "fps=100&binning=2"),
                      virtual_camera("mono12", 12, "fps=100"),
                      virtual_camera("mono12_packed", 12, "fps=100&pixel_format=Mono12Packed"),
                      virtual_camera("woven_fields", 8, "fps=100&fields=split-top"),
                      virtual_camera("sequenced_laser", 8, "fps=100&strobe=Line2&laser=0,dark"),
                      virtual_camera("host_switched_laser", 8,
                                     "fps=50&strobe=Line2&laser=0,dark&switching=host")),
    source_name);

}  // namespace
}  // namespace striper::testing
