// SPDX-License-Identifier: Apache-2.0
// striper design: what a striper would reach, before its parts are bought.
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/core/units.hpp>

#include "design/design_source.hpp"
#include "design/design_text.hpp"
#include "options/option_bounds.hpp"
#include "program/plot_file.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct DesignArguments {
  std::optional<double> fov_deg;
  std::optional<double> focal_mm;
  std::optional<double> sensor_width_mm;
  std::optional<int> columns;
  std::optional<int> rows;
  bool interlaced = false;
  bool dark = false;
  std::optional<double> baseline_m;
  std::optional<double> tilt_deg;
  std::vector<double> ranges_m;
  std::optional<double> energy_uj;
  std::optional<double> power_mw;
  std::optional<double> fan_deg;
  std::optional<double> thickness_deg;
  std::optional<double> wavelength_nm;
  std::optional<double> filter_nm;
  std::optional<double> shutter_us;
  std::optional<double> rate_hz;
  std::optional<double> f_number;
  std::optional<double> qe;
  std::optional<double> reflectance;
  std::optional<double> sun_w_m2_nm;
  std::optional<double> suppression;
  std::optional<std::string> from;
  std::optional<std::string> plot;
  bool paper = false;
  bool json = false;
};

constexpr const char* kDescription =
    "Compute what a striper would reach: steps, light, errors, maximum range.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper design --fov 55 --columns 640 --rows 480 --baseline 0.5 --tilt 14\n"
    "  striper design --focal 8 --sensor-width 7.2 --columns 1440 --rows 1080 --baseline 0.2\n"
    "      --range 0.5 --range 1 --power 50 --plot design.svg\n"
    "  striper design --from data/scenes/room.yaml --sun 0.9      the room's striper, in the sun\n"
    "  striper design --paper       what Mertz et al. 2002 print beside what comes out here\n\n"
    "With --fov all pixels have the same angle; with --focal the lens is a pinhole. With --from "
    "an\n"
    "option goes before what the file says. What is not given is as in the paper.";

using Number = std::optional<double>;

void add_number(Command& command, const char* name, Number& number, const char* help,
                const char* unit, const WordCheck& bounds) {
  command.add_option(name, number, help)->type_name(unit)->check(bounds);
}

void define_geometry(Command& command, DesignArguments& arguments) {
  add_number(command, "--fov", arguments.fov_deg, "Field of view across the columns", "DEG",
             between(0.1, 177.0));
  add_number(command, "--focal", arguments.focal_mm, "Focal length instead", "MM",
             between(0.1, 10000.0));
  add_number(command, "--sensor-width", arguments.sensor_width_mm, "Of the sensor, with --focal",
             "MM", between(0.1, 1000.0));
  command.get_option("--focal")->excludes("--fov")->needs("--sensor-width");
  command.get_option("--sensor-width")->needs("--focal");
  command.add_option("--columns", arguments.columns, "Of the image")
      ->type_name("N")
      ->check(between(8, 32768));
  command.add_option("--rows", arguments.rows, "Of the image")
      ->type_name("N")
      ->check(between(8, 32768));
  command.add_flag("--interlaced", arguments.interlaced, "Each frame is two fields");
  command.add_flag("--dark", arguments.dark, "Every other exposure is dark and subtracted");
  add_number(command, "--baseline", arguments.baseline_m, "From the laser up to the camera", "M",
             between(1e-3, 100.0));
  add_number(command, "--tilt", arguments.tilt_deg, "By how much the camera looks down", "DEG",
             between(-80.0, 80.0));
  command.add_option("--range", arguments.ranges_m, "Where to compute, again and again: 1 2 4 m")
      ->type_name("M")
      ->check(between(0.01, 1000.0))
      ->take_all();
}

void define_light(Command& command, DesignArguments& arguments) {
  add_number(command, "--energy", arguments.energy_uj, "Of a pulse, microjoule", "UJ",
             at_least(0.0));
  add_number(command, "--power", arguments.power_mw, "Of a steady laser instead", "MW",
             at_least(0.0));
  command.get_option("--power")->excludes("--energy");
  add_number(command, "--fan", arguments.fan_deg, "Full angle of the fan", "DEG",
             between(1e-3, 180.0));
  add_number(command, "--thickness", arguments.thickness_deg,
             "Of the laser plane, energy over peak", "DEG", between(1e-3, 57.0));
  add_number(command, "--wavelength", arguments.wavelength_nm, "Of the laser", "NM",
             between(320.0, 1080.0));
  add_number(command, "--filter", arguments.filter_nm, "Width of the filter's band", "NM",
             between(0.1, 40.0));
  add_number(command, "--shutter", arguments.shutter_us, "How long it is open", "US",
             between(1e-3, 1e9));
  add_number(command, "--rate", arguments.rate_hz, "Frames a second", "HZ", between(1e-3, 1e6));
  add_number(command, "--f-number", arguments.f_number, "Of the lens", "F", between(0.3, 100.0));
  add_number(command, "--qe", arguments.qe, "Quantum efficiency, 0 to 1", "Q", between(1e-9, 1.0));
  add_number(command, "--reflectance", arguments.reflectance, "Of the target, 0 to 1", "R",
             between(1e-9, 1.0));
  add_number(command, "--sun", arguments.sun_w_m2_nm, "In the filter's band", "W_M2_NM",
             between(0.0, 1000.0));
  add_number(command, "--suppression", arguments.suppression,
             "How much the filter takes of the sun, instead of its own", "X", between(1.0, 1e9));
}

void define(Command& command, DesignArguments& arguments) {
  define_geometry(command, arguments);
  define_light(command, arguments);
  command.add_option("--from", arguments.from, "A model or a scene to begin with")
      ->type_name("FILE");
  command.add_option("--plot", arguments.plot, "Errors and light over range")
      ->type_name("FILE.svg");
  command.add_flag("--paper", arguments.paper, "The paper's figures beside those computed here");
  command.add_flag("--json", arguments.json, "For programs, on the standard output");
  command.get_option("--paper")->excludes("--plot")->excludes("--json");
  command.footer(kExamples);
}

CameraModel camera_of(const DesignArguments& arguments) {
  if (!arguments.columns || !arguments.rows)
    throw Error(ErrorKind::kUsage, "give --columns and --rows, or --from");
  if (arguments.focal_mm)
    return pinhole_camera(*arguments.columns, *arguments.rows, 1e-3 * *arguments.focal_mm,
                          1e-3 * *arguments.sensor_width_mm);
  if (!arguments.fov_deg)
    throw Error(ErrorKind::kUsage, "give --fov, or --focal and --sensor-width, or --from");
  return equiangular_camera(*arguments.columns, *arguments.rows, kDegree * *arguments.fov_deg);
}

bool has_geometry(const DesignArguments& arguments) {
  return arguments.fov_deg || arguments.focal_mm || arguments.columns || arguments.rows ||
         arguments.baseline_m || arguments.tilt_deg;
}

StriperDesign start_of(const DesignArguments& arguments) {
  if (arguments.from) {
    if (has_geometry(arguments))
      throw Error(ErrorKind::kUsage,
                  "--from has the camera and where it stands: leave --fov, --focal, --columns, "
                  "--rows, --baseline and --tilt away");
    return load_design(*arguments.from);
  }
  if (!arguments.baseline_m) throw Error(ErrorKind::kUsage, "give --baseline, or --from");
  StriperDesign design = place_laser(camera_of(arguments), *arguments.baseline_m,
                                     kDegree * arguments.tilt_deg.value_or(0.0));
  if (arguments.sensor_width_mm)
    design.camera.pixel_pitch_m = 1e-3 * *arguments.sensor_width_mm / *arguments.columns;
  return design;
}

// Puts an option in the place of what a design says, in its unit.
void put(const Number& option, double unit, double& value) {
  if (option) value = unit * *option;
}

StriperDesign design_of(const DesignArguments& arguments) {
  StriperDesign design = start_of(arguments);
  design.camera.interlaced = design.camera.interlaced || arguments.interlaced;
  design.camera.dark_subtracted = design.camera.dark_subtracted || arguments.dark;
  put(arguments.energy_uj, 1e-6, design.laser.pulse_energy_j);
  if (arguments.power_mw) design.laser.power_w = 1e-3 * *arguments.power_mw;
  put(arguments.fan_deg, kDegree, design.laser.fan_rad);
  put(arguments.thickness_deg, kDegree, design.laser.thickness_rad);
  put(arguments.wavelength_nm, 1.0, design.laser.wavelength_nm);
  put(arguments.filter_nm, 1.0, design.camera.filter_width_nm);
  put(arguments.shutter_us, 1e-6, design.camera.shutter_s);
  put(arguments.rate_hz, 1.0, design.camera.rate_hz);
  put(arguments.f_number, 1.0, design.camera.f_number);
  put(arguments.qe, 1.0, design.camera.quantum_efficiency);
  put(arguments.reflectance, 1.0, design.reflectance);
  put(arguments.sun_w_m2_nm, 1.0, design.sun.spectral_w_m2_nm);
  if (arguments.suppression) design.sun.suppression = arguments.suppression;
  return design;
}

ExitCode run_design(const DesignArguments& arguments) {
  if (arguments.paper) {
    fmt::print("{}", paper_text());
    return ExitCode::kDone;
  }
  require_plot_file("--plot", arguments.plot);
  const DesignFigures figures(design_of(arguments));
  const std::vector<double> ranges_m =
      arguments.ranges_m.empty() ? std::vector<double>{1.0, 2.0, 4.0} : arguments.ranges_m;
  if (arguments.plot) {
    if (std::isnan(figures.near_m()))
      throw Error(ErrorKind::kBadValue, "the laser plane is not in the image: nothing to plot");
    write_plot_file(*arguments.plot, design_svg(figures));
  }
  if (arguments.json)
    print_json(design_json(figures, ranges_m));
  else
    fmt::print("{}", design_text(figures, ranges_m));
  return ExitCode::kDone;
}

}  // namespace

void add_design(Command& striper, Action& action) {
  add_command<DesignArguments>(striper, action, "design", kDescription, define, run_design);
}

}  // namespace striper::program
