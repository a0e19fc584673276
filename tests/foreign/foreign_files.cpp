// SPDX-License-Identifier: Apache-2.0
// Writes files for other people's readers to read, and what they must find in them:
//
//   foreign_files DIR
//
// DIR/points.ply, .pcd, .las and DIR/points_EXTENSION.json: their points. DIR/zstd.mcap,
// DIR/plain.mcap and DIR/repaired.mcap with messages of every type, every field of each with a
// value of its own, and DIR/expected.jsonl, DIR/repaired.jsonl: a line a message.
#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/wire/mcap_copy.hpp>
#include <striper/wire/point_file.hpp>

#include "support/filled_message.hpp"
#include "support/mcap_files.hpp"

namespace striper::wire {
namespace {

/// A message as the JSON that judge.mjs compares with.
class ExpectedText {
 public:
  template <typename T>
  void operator()(std::string_view name, const T& value) {
    fields_ += fmt::format("{}\"{}\":{}", fields_.empty() ? "" : ",", name, text(value));
  }
  std::string object() const { return fmt::format("{{{}}}", fields_); }

  static std::string text(double value) {
    return fmt::format("\"f64:{:016x}\"", std::bit_cast<std::uint64_t>(value));
  }
  static std::string text(float value) {
    return fmt::format("\"f32:{:08x}\"", std::bit_cast<std::uint32_t>(value));
  }
  static std::string text(bool value) { return fmt::format("\"b:{:d}\"", value); }
  static std::string text(std::byte value) {
    return fmt::format("\"i:{}\"", std::to_integer<int>(value));
  }
  static std::string text(const std::string& value) { return fmt::format("\"s:{}\"", value); }
  template <std::integral T>
  static std::string text(T value) {
    return fmt::format("\"i:{}\"", value);
  }
  template <Described M>
  static std::string text(const M& message) {
    ExpectedText fields;
    Description<M>::fields(message, fields);
    return fields.object();
  }
  template <typename T>
  requires requires(const T& values) { values.begin(); }
  static std::string text(const T& values) {
    std::string list;
    for (const auto& value : values)
      list += fmt::format("{}{}", list.empty() ? "" : ",", text(value));
    return fmt::format("[{}]", list);
  }

 private:
  std::string fields_;
};

struct Outputs {
  std::vector<std::unique_ptr<McapWriter>> writers;
  std::vector<std::string> lines;
  std::uint64_t time_ns = 1'700'000'000'000'000'000;
};

template <typename M>
void write_messages(Outputs& outputs, const std::string& topic, int count) {
  std::uint16_t channel = 0;
  for (auto& writer : outputs.writers)
    channel = writer->add_channel(ros_channel(topic, schema_of<M>()));
  std::vector<std::uint8_t> bytes;
  for (std::uint32_t sequence = 0; sequence < static_cast<std::uint32_t>(count); ++sequence) {
    const M message = striper::testing::filled_message<M>();
    write_cdr(message, bytes);
    outputs.time_ns += 1'000'000;
    for (auto& writer : outputs.writers)
      writer->write({channel, sequence, outputs.time_ns, outputs.time_ns, bytes});
    outputs.lines.push_back(
        fmt::format(R"({{"topic":"{}","sequence":{},"log_time":"{}","message":{}}})", topic,
                    sequence, outputs.time_ns, ExpectedText::text(message)));
  }
}

void write_every_type(Outputs& outputs) {
  constexpr int kEach = 40;
  write_messages<PointCloud2>(outputs, "/striper/points", kEach);
  write_messages<LaserScan>(outputs, "/striper/scan", kEach);
  write_messages<Image>(outputs, "/striper/image_raw", kEach);
  write_messages<CompressedImage>(outputs, "/striper/image_raw/compressed", kEach);
  write_messages<CameraInfo>(outputs, "/striper/camera_info", kEach);
  write_messages<TFMessage>(outputs, "/tf_static", kEach);
  write_messages<DiagnosticArray>(outputs, "/diagnostics", kEach);
  write_messages<PolarScan>(outputs, "/striper/polar_scan", kEach);
  write_messages<FrameInfo>(outputs, "/striper/frame_info", kEach);
  write_messages<Odometer>(outputs, "/odometer", kEach);
  write_messages<Event>(outputs, "/striper/events", kEach);
}

void save(const std::filesystem::path& path, const std::vector<std::string>& lines,
          std::size_t count) {
  std::ofstream file(path);
  for (std::size_t i = 0; i < count; ++i) file << lines[i] << '\n';
}

/// What is left of a file that was cut in the middle.
void write_repaired(const std::filesystem::path& directory, const std::vector<std::string>& lines) {
  const auto whole = directory / "plain.mcap";
  const auto cut = directory / "cut.mcap";
  std::filesystem::copy_file(whole, cut, std::filesystem::copy_options::overwrite_existing);
  std::filesystem::resize_file(cut, std::filesystem::file_size(whole) / 2);
  const McapCopied repaired = copy_mcap(cut, directory / "repaired.mcap");
  std::filesystem::remove(cut);
  save(directory / "repaired.jsonl", lines, repaired.messages);
}

std::vector<CloudPoint> some_points() {
  std::vector<CloudPoint> points(500);
  const auto any = [] { return static_cast<float>(striper::testing::uniform(-9.0, 9.0)); };
  for (CloudPoint& point : points) {
    if (striper::testing::uniform(0.0, 1.0) < 0.1) continue;
    point = {any(), any(),
             any(), static_cast<float>(std::lround(striper::testing::uniform(0.0, 255.0))),
             any(), any(),
             any(), any(),
             0,     striper::testing::uniform(0.0, 2e9)};
  }
  return points;
}

/// Points with and without those that are missing.
void write_points(const std::filesystem::path& directory, const std::string& extension) {
  const std::vector<CloudPoint> points = some_points();
  std::ofstream stream(directory / ("points" + extension), std::ios::binary);
  const auto file = make_point_file(*point_format_from_extension(extension), stream);
  for (std::size_t scan = 0; scan < 5; ++scan)
    file->write(std::span(points).subspan(100 * scan, 100));
  file->flush();
  std::string list;
  for (const CloudPoint& point : points) {
    if (std::isnan(point.x_m) && extension != ".pcd") continue;
    const auto number = [](float value) {
      return std::isnan(value) ? "null" : fmt::format("{}", double{value});
    };
    list += fmt::format("{}[{},{},{},{}]", list.empty() ? "" : ",", number(point.x_m),
                        number(point.y_m), number(point.z_m), number(point.intensity));
  }
  std::ofstream(directory / fmt::format("points_{}.json", extension.substr(1)))
      << '[' << list << "]\n";
}

void write_files(const std::filesystem::path& directory) {
  for (const char* extension : {".ply", ".pcd", ".las"}) write_points(directory, extension);
  Outputs outputs;
  outputs.writers.push_back(std::make_unique<McapWriter>(directory / "zstd.mcap",
                                                         McapWriterOptions{.chunk_bytes = 20'000}));
  outputs.writers.push_back(std::make_unique<McapWriter>(
      directory / "plain.mcap",
      McapWriterOptions{.compression = McapCompression::kNone, .chunk_bytes = 20'000}));
  for (auto& writer : outputs.writers) {
    writer->attach({"striper/striper.yaml", "application/yaml", 1, 2, "striper_model: 1\n"});
    writer->add_metadata({"striper", {{"frame_info", "1"}}});
  }
  write_every_type(outputs);
  for (auto& writer : outputs.writers) writer->close();
  save(directory / "expected.jsonl", outputs.lines, outputs.lines.size());
  write_repaired(directory, outputs.lines);
}

}  // namespace
}  // namespace striper::wire

int main(int count, char** words) {
  if (count != 2) {
    std::cerr << "usage: foreign_files DIR\n";
    return 2;
  }
  try {
    striper::testing::reseed();
    std::filesystem::create_directories(words[1]);
    striper::wire::write_files(words[1]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
