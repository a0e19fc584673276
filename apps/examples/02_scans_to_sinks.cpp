// SPDX-License-Identifier: Apache-2.0
// Gives scans to files and programs: 02_scans_to_sinks SOURCE MODEL SINK...
#include <iostream>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/scans/open_scans.hpp>
#include <striper/stream/open_sink.hpp>
#include <striper/stream/scan_bus.hpp>

void say(const striper::Event& event) {
  std::cerr << event.code.word() << ": " << event.message << '\n';
}

// A recording of scans (run.csv, run.jsonl) does as well as a camera.
void give(const char* source_name, const char* model_name, int sinks, char** sink_names) {
  const striper::EventPort events(say);
  const auto model = std::make_shared<striper::StriperModel>(striper::load_model(model_name));
  const auto scans = striper::open_scans(source_name, model, {}, events);

  striper::ScanBus bus(events);  // A thread and a queue for each sink: none holds up another.
  for (int i = 0; i < sinks; ++i) bus.add(sink_names[i], striper::open_sink(sink_names[i]));
  bus.open(scans->info());
  striper::PolarScan scan;
  while (scans->next(scan, std::chrono::seconds(1)) == striper::NextStatus::kFrame) {
    bus.write(std::make_shared<const striper::PolarScan>(scan));
  }
  bus.finish();
  if (bus.failure()) std::rethrow_exception(bus.failure());
}

int main(int argc, char** argv) try {
  if (argc < 4) {
    throw striper::Error(striper::ErrorKind::kUsage,
                         "usage: 02_scans_to_sinks SOURCE MODEL SINK... (csv:FILE, jsonl:FILE)");
  }
  give(argv[1], argv[2], argc - 3, argv + 3);
  return 0;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
