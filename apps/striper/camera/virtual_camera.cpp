// SPDX-License-Identifier: Apache-2.0
// striper virtual-camera: a scene as a GigE Vision camera on this machine.
#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <thread>

#include <fmt/format.h>

#include <striper/capture/source_uri.hpp>
#include <striper/core/csv_table.hpp>
#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/simulator/simulated_source.hpp>
#include <striper/virtual_camera/virtual_camera.hpp>

#include "camera/camera_commands.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"

namespace striper::program {
namespace {

struct VirtualCameraArguments {
  std::string scene;
  VirtualCameraOptions camera;
  double clock_skew_ppm = 0.0;
  int loop = 0;
  std::string registers;
  std::optional<double> seconds;
};

constexpr const char* kDescription =
    "Virtual camera: serves a simulated scene as a GigE Vision camera on this machine, so that "
    "the\n"
    "whole product, and any other GigE Vision program, can be tried without hardware.";

constexpr const char* kExamples =
    "Line2 fires laser 0, Line3 laser 1; until a client sets one of them the scene's lasers fire "
    "by\n"
    "themselves. It answers on 127.0.0.0/8 only.\n\n"
    "Examples:\n"
    "  striper virtual-camera data/scenes/room.yaml &\n"
    "  striper devices\n"
    "  striper capture gige:STRIPER1 -o scans.csv --frames 100\n"
    "  striper capture 'gige:STRIPER1?strobe=Line2&laser=0,dark&fps=60' --seconds 5\n"
    "  arv-tool-0.8 -a 127.0.0.1 control ExposureTime=250\n"
    "      another GenICam client\n"
    "  striper virtual-camera data/scenes/wall.yaml --loop 50 --lost-packets 0.001\n"
    "      fast, and a bad cable";

void define(Command& command, VirtualCameraArguments& arguments) {
  command
      .add_option("SCENE", arguments.scene,
                  "The scene file, with the keys of a sim: source where wanted (?noise=off)")
      ->required();
  command
      .add_option("--address", arguments.camera.address,
                  "Where it is, one of 127.0.0.0/8; default 127.0.0.1")
      ->type_name("IP");
  command.add_option("--serial", arguments.camera.serial, "Its name; default STRIPER1")
      ->type_name("TEXT");
  command
      .add_option("--loop", arguments.loop,
                  "Make the first N frames in advance and repeat them: for high frame rates")
      ->type_name("N")
      ->check(above_zero());
  command
      .add_option("--lost-packets", arguments.camera.lost_packets,
                  "Fraction of the packets that are lost; default 0")
      ->type_name("0..1");
  command.add_flag("!--no-resend", arguments.camera.can_resend,
                   "The camera cannot send packets again");
  command.add_option("--mtu", arguments.camera.mtu, "Larger packets are lost; default 16000")
      ->type_name("BYTES");
  command.add_option("--link", arguments.camera.link_mbit_s, "Speed of its cable; default 1000")
      ->type_name("MBIT/S")
      ->check(above_zero());
  command.add_option("--clock-skew", arguments.clock_skew_ppm, "Its clock is fast by this")
      ->type_name("PPM");
  command
      .add_option("--registers", arguments.registers,
                  "At the end write what clients set, as CSV: time_s, client, register, value,\n"
                  "laser_armed")
      ->type_name("FILE");
  command.add_option("--seconds", arguments.seconds, "End after so long; default: Ctrl-C")
      ->type_name("S")
      ->check(above_zero());
  command.footer(kExamples);
}

std::shared_ptr<VirtualScene> load(const VirtualCameraArguments& arguments) {
  const std::string& text = arguments.scene;
  const auto source =
      SimulatedSource::open(SourceUri::parse(text.starts_with("sim:") ? text : "sim:" + text));
  const auto scene = make_virtual_scene(source->simulator().scene());
  return arguments.loop > 0 ? make_looped_scene(scene, arguments.loop) : scene;
}

// A line of what `--registers` writes.
struct RegisterRow {
  double time_s = 0.0;
  RegisterWrite write;
};

template <typename Cell>
constexpr CsvColumn<RegisterRow> column(std::string_view name, Cell cell) {
  return csv_column<RegisterRow>(name, cell);
}

constexpr std::array kRegisterColumns{
    column(
        "time_s", [](auto& r) -> auto& { return r.time_s; }),
    column(
        "client", [](auto& r) -> auto& { return r.write.controller; }),
    column(
        "register", [](auto& r) -> auto& { return r.write.name; }),
    column(
        "value", [](auto& r) -> auto& { return r.write.value; }),
    column(
        "laser_armed", [](auto& r) -> auto& { return r.write.is_laser_armed; }),
};

void write_registers(const VirtualCamera& camera, const std::string& path) {
  using Table = CsvWriter<RegisterRow>;
  std::string text;
  Table::append_header(text, kRegisterColumns);
  for (const RegisterWrite& one : camera.register_writes()) {
    Table::append(text, kRegisterColumns, {1e-9 * static_cast<double>(one.time_ns), one});
  }
  write_file_atomically(path, text);
}

ExitCode serve(const VirtualCameraArguments& arguments) {
  VirtualCameraOptions options = arguments.camera;
  options.clock_skew = 1e-6 * arguments.clock_skew_ppm;
  options.validate();
  if (!arguments.registers.empty()) require_writable(arguments.registers);
  const VirtualCamera camera(load(arguments), options);
  say(fmt::format("{} is gige:{} at {}; Ctrl-C ends it", arguments.scene, options.serial,
                  options.address));

  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  const auto is_over = [&] {
    return arguments.seconds &&
           std::chrono::duration<double>(Clock::now() - begin).count() > *arguments.seconds;
  };
  while (!stop_requested() && !is_over()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  if (!arguments.registers.empty()) write_registers(camera, arguments.registers);
  const VirtualCameraStatistics did = camera.statistics();
  say(fmt::format("{} frames, {} packets, {} lost on purpose, {} sent again, {} clients",
                  did.frames, did.packets, did.lost, did.resent, did.controllers));
  return ExitCode::kDone;
}

}  // namespace

void add_virtual_camera(Command& striper, Action& action) {
  add_command<VirtualCameraArguments>(striper, action, "virtual-camera", kDescription, define,
                                      serve);
}

}  // namespace striper::program
