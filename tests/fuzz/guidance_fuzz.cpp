// SPDX-License-Identifier: Apache-2.0
// Whatever guidance.yaml, a road or sweeps.csv hold, they are refused with an error or used: what
// is read is read again as it was written, a road can be driven, sweeps can be guided by.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include <striper/core/error.hpp>
#include <striper/guidance/guidance.hpp>
#include <striper/road/road_drive.hpp>

namespace {

void guide(const std::string& text) {
  striper::SweepReader reader(striper::CsvInput::of_text("sweeps.csv", text));
  striper::GuidanceListener nobody;
  striper::Guidance guidance(striper::report_truck(), nobody);
  striper::BeamSweep sweep;
  while (reader.next(sweep)) guidance.take(sweep);
  guidance.finish();
}

void drive(const striper::Road& road) {
  constexpr double kLongest_m = 50.0;
  if (road.length_m > kLongest_m) return;
  striper::RoadDrive drive(road);
  striper::BeamSweep sweep;
  striper::OdometerReading reading;
  for (int i = 0; i < 50 && drive.next(sweep, reading) != striper::RoadDrive::Next::kEnd; ++i) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    if (text.find("striper_guidance") != std::string::npos) {
      const std::string written = format_guidance(striper::parse_guidance(text, "guidance.yaml"));
      if (format_guidance(striper::parse_guidance(written, "guidance.yaml")) != written)
        std::abort();
    } else if (text.find("striper_road") != std::string::npos) {
      drive(striper::parse_road(text, "road.yaml"));
    } else {
      guide(text);
    }
  } catch (const striper::Error&) {  // Refused: fine.
  }
  return 0;
}
