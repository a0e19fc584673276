// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/stream/mcap_recording.hpp>

#include "stream/sinks/built_in.hpp"

namespace striper {
namespace {

// A recording of scans, status and events, of any number of heads.
class McapScanSink : public ScanSink {
 public:
  McapScanSink(const std::string& path, wire::McapRotation rotation, double frames_hz)
      : frames_hz_(frames_hz), recording_(path, rotation) {
    if (path.empty() || path == "-") {
      throw Error(ErrorKind::kUsage, "a recording goes to a file: mcap:FILE");
    }
    require_replaceable(path, {"\x89MCAP"}, "scans");
  }

  SinkNeeds needs() const override {
    SinkNeeds needs;
    needs.status = true;
    needs.frames_hz = frames_hz_;
    return needs;
  }

  void open(const HeadInfo& head) override { recording_.open(head); }
  void write(const PolarScan& scan) override { recording_.write(scan); }
  void write(const Frame& frame) override { recording_.write(frame); }
  void status(const ScannerStatus& status) override { recording_.write(status); }
  void event(const Event& event) override { recording_.write(event); }
  void curbs(const CurbsSeen& seen) override { recording_.write(seen); }
  void objects(const ObjectsSeen& seen) override { recording_.write(seen); }
  void finish() override { recording_.close(); }

 private:
  double frames_hz_;
  McapRecording recording_;
};

}  // namespace

std::unique_ptr<ScanSink> detail::make_mcap_sink(SinkUri uri) {
  constexpr double kMostFrames_hz = 1e4;
  wire::McapRotation rotation;
  if (const auto rotate = uri.take("rotate")) rotation = wire::McapRotation::parse(*rotate);
  const double frames_hz = uri.take_number("frames", 0.0, kMostFrames_hz).value_or(0.0);
  uri.refuse_unused("rotate, frames");
  return std::make_unique<McapScanSink>(uri.path(), rotation, frames_hz);
}

}  // namespace striper
