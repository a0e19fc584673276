// SPDX-License-Identifier: Apache-2.0
// Proves that adding a sink is one file and one line: this one counts scans.
#include <gtest/gtest.h>

#include <striper/stream/open_sink.hpp>
#include <striper/stream/scan_bus.hpp>

#include "support/made_scans.hpp"

namespace striper {
namespace {

int counted = 0;

class CountingSink : public ScanSink {
 public:
  using ScanSink::write;
  void write(const PolarScan& /*scan*/) override { ++counted; }
};

TEST(RegisterSink, SinkIsThereByItsAddress) {
  register_sink("count", [](SinkUri) { return std::make_unique<CountingSink>(); });

  ScanBus bus;
  bus.add("count:", open_sink("count:"));
  for (const auto& scan : testing::made_scans(7)) bus.write(scan);
  bus.finish();
  EXPECT_EQ(counted, 7);
}

TEST(RegisterSink, ExtensionNamesItToo) {
  register_sink(
      "count", [](SinkUri) { return std::make_unique<CountingSink>(); }, ".count");
  EXPECT_EQ(SinkUri::parse("dir/a.count").scheme(), "count");
}

}  // namespace
}  // namespace striper
