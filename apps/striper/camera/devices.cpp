// SPDX-License-Identifier: Apache-2.0
// striper devices: every camera that can be opened and how to name it; --check-sync: whether laser
// and shutter run together.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <striper/ambient/sync_check.hpp>
#include <striper/capture/list_cameras.hpp>
#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>

#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct DevicesArguments {
  std::string check_sync;
  std::string axis = "columns";
  double seconds = 3.0;
  bool all = false;
  bool json = false;
};

constexpr const char* kDescription =
    "List cameras: every one that striper can open, what it has, and the address to use.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper devices\n"
    "      each camera with its inputs, pixel formats and sizes\n"
    "  striper devices --all\n"
    "      also every control, to set as ?name=value in the address\n"
    "  striper devices --json\n"
    "      everything, for programs\n"
    "  striper devices --check-sync 'v4l2:/dev/video0?standard=ntsc'\n"
    "      does the laser fire in every second field, and in which? Point the camera at the "
    "stripe\n"
    "      on something plain and still. Exit code 3 where they do not run together.";

void define(Command& command, DevicesArguments& arguments) {
  command
      .add_option("--check-sync", arguments.check_sync,
                  "Watch this source: laser and shutter together?")
      ->type_name("SOURCE");
  command
      .add_option("--axis", arguments.axis,
                  "The stripe has one centre in each of the columns, or of the rows")
      ->type_name("NAME")
      ->check(one_of({"columns", "rows"}))
      ->capture_default_str();
  command.add_option("--seconds", arguments.seconds, "How long to watch")
      ->type_name("S")
      ->check(above_zero())
      ->capture_default_str();
  command.add_flag("--all", arguments.all, "Also the controls and every size and rate");
  command.add_flag("--json", arguments.json, "Everything for programs, on the standard output");
  command.footer(kExamples);
}

nlohmann::json to_json(const CameraFormat& format) {
  nlohmann::json sizes = nlohmann::json::array();
  for (const CameraSize& size : format.sizes)
    sizes.push_back({{"width", size.width}, {"height", size.height}, {"rates_hz", size.rates_hz}});
  return {{"name", format.name},
          {"description", format.description},
          {"usable", format.is_usable},
          {"sizes", sizes},
          {"size_range", format.size_range}};
}

nlohmann::json to_json(const CameraControl& control) {
  return {{"name", control.name},
          {"type", control.type},
          {"minimum", control.minimum},
          {"maximum", control.maximum},
          {"step", control.step},
          {"default", control.default_value},
          {"value", control.value ? nlohmann::json(*control.value) : nlohmann::json(nullptr)},
          {"menu", control.menu},
          {"settable", control.is_settable}};
}

nlohmann::json to_json(const CameraListing& camera) {
  nlohmann::json inputs = nlohmann::json::array();
  for (const CameraInput& input : camera.inputs) {
    inputs.push_back({{"index", input.index},
                      {"name", input.name},
                      {"standards", input.standards},
                      {"trouble", input.trouble},
                      {"current", input.is_current}});
  }
  nlohmann::json formats = nlohmann::json::array();
  for (const CameraFormat& format : camera.formats) formats.push_back(to_json(format));
  nlohmann::json controls = nlohmann::json::array();
  for (const CameraControl& control : camera.controls) controls.push_back(to_json(control));
  return {{"uri", camera.uri},         {"kind", camera.kind},
          {"name", camera.name},       {"serial", camera.serial},
          {"driver", camera.driver},   {"address", camera.address},
          {"access", camera.access},   {"other_uris", camera.other_uris},
          {"trouble", camera.trouble}, {"inputs", inputs},
          {"formats", formats},        {"controls", controls}};
}

std::string describe(const CameraSize& size) {
  std::string text = fmt::format("{}x{}", size.width, size.height);
  if (!size.rates_hz.empty()) {
    const double fastest = *std::max_element(size.rates_hz.begin(), size.rates_hz.end());
    text += fmt::format(" to {:.4g}/s", fastest);
  }
  return text;
}

std::string sizes_of(const CameraFormat& format, bool all) {
  if (format.sizes.empty()) return format.size_range;
  std::vector<std::string> each;
  each.reserve(format.sizes.size());
  for (const CameraSize& size : format.sizes) each.push_back(describe(size));
  const bool is_short = !all && each.size() > 3;
  if (is_short) each.erase(each.begin() + 1, each.end() - 1);
  return fmt::format("{}", fmt::join(each, is_short ? " ... " : ", "));
}

void print_control(const CameraControl& control) {
  std::string value = control.value ? fmt::format("{:.10g}", *control.value) : "-";
  fmt::print("    {:<32} {:<12} {:.10g} to {:.10g}, now {}{}\n", control.name, control.type,
             control.minimum, control.maximum, value, control.is_settable ? "" : " (read only)");
  for (const std::string& entry : control.menu) fmt::print("        {}\n", entry);
}

// Formats that come in the same sizes share a line unless everything is asked for.
void print_formats(const CameraListing& camera, bool all) {
  std::vector<std::pair<std::string, std::string>> lines;  // Sizes, and the formats that have them.
  std::size_t unusable = 0;
  for (const CameraFormat& format : camera.formats) {
    unusable += format.is_usable ? 0 : 1;
    if (!format.is_usable) continue;
    const std::string sizes = sizes_of(format, all);
    if (!all && !lines.empty() && lines.back().first == sizes) {
      lines.back().second += " " + format.name;
    } else {
      lines.emplace_back(
          sizes, all ? fmt::format("{:<6} {}", format.name, format.description) : format.name);
    }
  }
  fmt::print("  pixel formats\n");
  for (const auto& [sizes, formats] : lines) fmt::print("    {}: {}\n", formats, sizes);
  if (unusable > 0) fmt::print("    and {} that striper does not read\n", unusable);
}

void print_camera(const CameraListing& camera, bool all) {
  fmt::print("{}\n  {}", camera.uri, camera.name);
  if (!camera.serial.empty()) fmt::print(" {}", camera.serial);
  if (!camera.driver.empty()) fmt::print(" ({}, {})", camera.driver, camera.address);
  fmt::print("{}\n", camera.access.empty() ? "" : ", " + camera.access);
  if (!camera.trouble.empty()) fmt::print("  cannot be opened: {}\n", camera.trouble);
  for (const std::string& uri : camera.other_uris) fmt::print("  also {}\n", uri);
  for (const CameraInput& input : camera.inputs) {
    fmt::print("  input {} '{}'{}", input.index, input.name, input.is_current ? ", in use" : "");
    if (!input.standards.empty()) fmt::print(", standards {}", fmt::join(input.standards, " "));
    if (!input.trouble.empty()) fmt::print(", {}", input.trouble);
    fmt::print("\n");
  }
  if (!camera.formats.empty()) print_formats(camera, all);
  if (camera.controls.empty()) return;
  if (!all) {
    fmt::print("  {} controls (--all lists them)\n", camera.controls.size());
    return;
  }
  fmt::print("  controls\n");
  for (const CameraControl& control : camera.controls) print_control(control);
}

ExitCode list(const DevicesArguments& arguments) {
  const std::vector<CameraListing> cameras = list_cameras();
  if (arguments.json) {
    nlohmann::json all = nlohmann::json::array();
    for (const CameraListing& camera : cameras) all.push_back(to_json(camera));
    print_json({{"cameras", all}});
    return ExitCode::kDone;
  }
  for (const CameraListing& camera : cameras) print_camera(camera, arguments.all);
  if (cameras.empty()) {
    say("no camera found: is it plugged in and switched on? Image files (images:DIR) and the "
        "simulator "
        "(sim:SCENE.yaml) need none.");
  }
  return ExitCode::kDone;
}

const char* field_name(Field field) {
  switch (field) {
    case Field::kTop:
      return "top";
    case Field::kBottom:
      return "bottom";
    case Field::kInterlacedTopFirst:
      return "interlaced, top field first";
    case Field::kInterlacedBottomFirst:
      return "interlaced, bottom field first";
    case Field::kProgressive:
      break;
  }
  return "progressive";
}

const char* verdict_name(SyncVerdict verdict) {
  switch (verdict) {
    case SyncVerdict::kLocked:
      return "locked";
    case SyncVerdict::kSlipping:
      return "slipping";
    case SyncVerdict::kNoDifference:
      return "no_difference";
    case SyncVerdict::kTooFew:
      break;
  }
  return "too_few_pictures";
}

const char* advice_on(SyncVerdict verdict) {
  switch (verdict) {
    case SyncVerdict::kLocked:
      return "laser and shutter run together";
    case SyncVerdict::kSlipping:
      return "the laser changes from one exposure to the other: its trigger must come from the\n"
             "camera's own vertical sync (or strobe), and every second one of it";
    case SyncVerdict::kNoDifference:
      return "no exposure shows a stripe that another lacks: the laser is off, on in every\n"
             "exposure, out of the image, or drowned";
    case SyncVerdict::kTooFew:
      break;
  }
  return "too few good frames to tell; try longer (--seconds)";
}

// "in the bottom field, the first exposure of two", or by the pattern alone.
std::string lit_exposures(const SyncReport& report) {
  const std::vector<Illumination>& entries = report.pattern.entries();
  if (entries.size() != 2) return fmt::format("in {}", report.pattern.to_string());
  return fmt::format("in the {}{} exposure of two",
                     report.lit_field != Field::kProgressive
                         ? std::string(field_name(report.lit_field)) + " field, the "
                         : "",
                     entries.front().is_lit() ? "first" : "second");
}

void print_sync(const SyncReport& report) {
  fmt::print("frames    {}, {:.3f}/s measured", field_name(report.field), report.rate_hz);
  if (report.nominal_rate_hz > 0.0) fmt::print(" ({:.3f} nominal)", report.nominal_rate_hz);
  fmt::print(", times even to {:.2f} ms\n", report.jitter_ms);
  const SourceStatistics& lost = report.statistics;
  fmt::print("lost      {} dropped by the driver, {} not read in time, {} damaged\n", lost.dropped,
             lost.overrun, lost.corrupt + lost.incomplete + lost.wrong_size);
  fmt::print("looked    {} times at {} frames: {} agree, {} show another order, {} none\n",
             report.windows, SyncReport::kWindowFrames, report.agreeing, report.others,
             report.unclear);
  if (report.verdict == SyncVerdict::kLocked) {
    fmt::print("laser     {}, its stripe {:.0f} % of a clear one: laser={}\n",
               lit_exposures(report), 100.0 * report.surplus, report.pattern.to_string());
  }
  fmt::print("{}: {}\n", verdict_name(report.verdict), advice_on(report.verdict));
}

nlohmann::json to_json(const SyncReport& report) {
  const bool is_locked = report.verdict == SyncVerdict::kLocked;
  return {
      {"verdict", verdict_name(report.verdict)},
      {"laser", is_locked ? nlohmann::json(report.pattern.to_string()) : nlohmann::json(nullptr)},
      {"lit_field",
       is_locked ? nlohmann::json(field_name(report.lit_field)) : nlohmann::json(nullptr)},
      {"field_order", field_name(report.field)},
      {"windows", report.windows},
      {"agreeing", report.agreeing},
      {"others", report.others},
      {"unclear", report.unclear},
      {"surplus", report.surplus},
      {"rate_hz", report.rate_hz},
      {"nominal_rate_hz", report.nominal_rate_hz},
      {"jitter_ms", report.jitter_ms},
      {"dropped", report.statistics.dropped},
      {"overrun", report.statistics.overrun},
      {"corrupt", report.statistics.corrupt}};
}

ExitCode check(const DevicesArguments& arguments) {
  const auto source = open_source(arguments.check_sync, TerminalEvents().port());
  if (!arguments.json) say(source->info().description);
  const SyncReport report =
      striper::check_sync(*source, {arguments.seconds, [] { return stop_requested(); },
                                    *stripe_axis_from_string(arguments.axis)});
  if (report.windows == 0 && report.rate_hz == 0.0)
    throw Error(ErrorKind::kDevice, fmt::format("{}: gave no frame", arguments.check_sync));
  if (arguments.json) {
    print_json(to_json(report));
  } else {
    print_sync(report);
  }
  return report.verdict == SyncVerdict::kLocked ? ExitCode::kDone : ExitCode::kUntrustworthy;
}

ExitCode devices(const DevicesArguments& arguments) {
  return arguments.check_sync.empty() ? list(arguments) : check(arguments);
}

}  // namespace

void add_devices(Command& striper, Action& action) {
  add_command<DevicesArguments>(striper, action, "devices", kDescription, define, devices);
}

}  // namespace striper::program
