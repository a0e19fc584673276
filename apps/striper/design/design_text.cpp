// SPDX-License-Identifier: Apache-2.0
#include "design/design_text.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/units.hpp>
#include <striper/design/eye_safety.hpp>
#include <striper/design/paper_table.hpp>
#include <striper/design/solar_spectrum.hpp>

#include "program/svg_chart.hpp"

namespace striper::program {
namespace {

double derived_suppression(const StriperDesign& design) {
  return solar_suppression(design.laser.wavelength_nm, design.camera.filter_width_nm);
}

std::string inputs_text(const StriperDesign& design) {
  const DesignLaser& laser = design.laser;
  const DesignCamera& camera = design.camera;
  std::string text = "what was put in\n";
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "  camera      {} x {}{}, {:g} Hz, shutter {:g} us, {} bits{}\n",
                 design.model.camera.width(), design.model.camera.height(),
                 camera.interlaced ? " interlaced" : "", camera.rate_hz, 1e6 * camera.shutter_s,
                 camera.bit_depth, camera.dark_subtracted ? ", dark exposures subtracted" : "");
  fmt::format_to(
      out,
      "  light       f/{:g}, lens {:g}, filter {:g} nm of {:g}, QE {:g}, pixel {:.3g} um,"
      " {:g} DN/e, read noise {:g} e\n",
      camera.f_number, camera.lens_transmission, camera.filter_width_nm, camera.filter_transmission,
      camera.quantum_efficiency, 1e6 * camera.pixel_pitch_m, camera.dn_per_electron,
      camera.read_noise_e);
  const std::string strength = laser.power_w
                                   ? fmt::format("{:g} mW steady", 1e3 * *laser.power_w)
                                   : fmt::format("{:g} uJ a pulse", 1e6 * laser.pulse_energy_j);
  fmt::format_to(out, "  laser       {}, {:g} nm, {:.4g} x {:.3g} degrees\n", strength,
                 laser.wavelength_nm, laser.fan_rad / kDegree, laser.thickness_rad / kDegree);
  fmt::format_to(out, "  target      reflectance {:g}, faces sun and laser; sun {:g} W/m2\n",
                 design.reflectance, design.sun.total_w_m2);
  return text;
}

std::string coverage_text(const DesignFigures& figures, double range_m) {
  const double degrees = figures.coverage_rad(range_m) / kDegree;
  return std::isnan(degrees) ? fmt::format("{:g} m straight ahead is not in the image", range_m)
                             : fmt::format("covers {:.1f} degrees at {:g} m", degrees, range_m);
}

std::string limits_text(const DesignFigures& figures) {
  if (std::isnan(figures.near_m())) return "sees nothing of the laser plane";
  return fmt::format(
      "sees {:.2f} m to {}", figures.near_m(),
      std::isinf(figures.far_m()) ? "the horizon" : fmt::format("{:.2f} m", figures.far_m()));
}

std::string outcome_text(const DesignFigures& figures, double first_m) {
  const StriperDesign& design = figures.design();
  std::string text = "what comes out\n";
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "  angle of a pixel {:.3f} degrees; {}\n",
                 figures.angular_resolution_rad() / kDegree, coverage_text(figures, first_m));
  fmt::format_to(out, "  {}; {:g} scans a second\n", limits_text(figures), figures.scan_rate_hz());
  fmt::format_to(out,
                 "  laser to sun 1 : {:.3g} at {:g} m; the shutter gains {:.5g}, the filter {:.3g} "
                 "({}; {:.3g} from the AM1.5 spectrum)\n",
                 1.0 / figures.laser_to_sun(first_m), first_m, figures.shutter_factor(),
                 figures.filter_factor(), design.sun.suppression ? "given" : "as the sun is given",
                 derived_suppression(design));
  const double farthest_m = figures.max_range_m();
  fmt::format_to(out, "  maximum range {} ({:g} found, {:g} false in a scan line)\n",
                 std::isnan(farthest_m) ? "none" : fmt::format("{:.2f} m", farthest_m),
                 design.detection, design.false_alarm);
  return text;
}

std::string range_table(const DesignFigures& figures, const std::vector<double>& ranges_m) {
  std::string text =
      "  range  one pixel out  derivative   signal  background  signal/   SNR    sigma   found\n"
      "      m             cm          cm       DN          DN  background         mm       %\n";
  for (const double range_m : ranges_m) {
    const RangeFigures at = figures.at(range_m);
    if (std::isnan(at.step_derivative_m)) {
      text += fmt::format("{:7.2f}  not in the image\n", range_m);
      continue;
    }
    text += fmt::format(
        "{:7.2f}  {:12.2f}  {:10.2f}  {:7.1f}  {:10.2f}  {:10.2f}  {:4.1f}  {:7.2f}"
        "  {:6.2f}{}\n",
        range_m, 100.0 * at.step_out_m, 100.0 * at.step_derivative_m, at.signal_dn,
        at.background_dn, at.signal_to_background, at.snr, 1e3 * at.sigma_m, 100.0 * at.detection,
        at.is_clipped ? " clipped" : "");
  }
  return text;
}

const char* standing_text(Requirement::Standing standing) {
  switch (standing) {
    case Requirement::Standing::kMet:
      return "yes";
    case Requirement::Standing::kNotMet:
      return "no";
    case Requirement::Standing::kNotComputed:
      return "-";
  }
  return "";
}

const char* standing_word(Requirement::Standing standing) {
  switch (standing) {
    case Requirement::Standing::kMet:
      return "met";
    case Requirement::Standing::kNotMet:
      return "not_met";
    case Requirement::Standing::kNotComputed:
      return "not_computed";
  }
  return "";
}

std::string requirements_text(const DesignFigures& figures) {
  std::string text = "the paper's ten requirements\n";
  for (const Requirement& one : figures.requirements())
    text += fmt::format("{:4d} {:<4} {:<44} {}\n", one.number, standing_text(one.standing),
                        one.wanted, one.reached);
  return text;
}

nlohmann::json finite(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

// Ranges of a plot, evenly spaced in their logarithm.
std::vector<double> plotted_ranges(const DesignFigures& figures) {
  constexpr int kPoints = 160;
  const double near_m = figures.near_m();
  const double reach_m = std::isnan(figures.max_range_m()) ? 4.0 * near_m : figures.max_range_m();
  const double far_m = std::min(figures.far_m(), std::max(1.3 * reach_m, 2.0 * near_m));
  std::vector<double> ranges_m;
  for (int i = 0; i <= kPoints; ++i)
    ranges_m.push_back(near_m * std::pow(far_m / near_m, static_cast<double>(i) / kPoints));
  return ranges_m;
}

ChartAxis range_axis(const std::vector<double>& ranges_m) {
  return {"range (m)", ranges_m.front(), ranges_m.back(), true};
}

// A logarithmic axis that holds all values, from a decade to a decade.
ChartAxis decades(const std::string& label, const std::vector<std::vector<Eigen::Vector2d>>& all) {
  double low = std::numeric_limits<double>::infinity();
  double high = 0.0;
  for (const auto& points : all) {
    for (const Eigen::Vector2d& point : points) {
      if (!std::isfinite(point.y()) || point.y() <= 0.0) continue;
      low = std::min(low, point.y());
      high = std::max(high, point.y());
    }
  }
  if (!(high > 0.0)) return {label, 0.1, 10.0, true};
  return {label, std::pow(10.0, std::floor(std::log10(low))),
          std::pow(10.0, std::floor(std::log10(high)) + 1.0), true};
}

}  // namespace

std::string design_text(const DesignFigures& figures, const std::vector<double>& ranges_m) {
  return inputs_text(figures.design()) + outcome_text(figures, ranges_m.front()) +
         range_table(figures, ranges_m) + requirements_text(figures);
}

nlohmann::json design_json(const DesignFigures& figures, const std::vector<double>& ranges_m) {
  const StriperDesign& design = figures.design();
  nlohmann::json json;
  json["angular_resolution_deg"] = figures.angular_resolution_rad() / kDegree;
  json["coverage_deg"] = finite(figures.coverage_rad(ranges_m.front()) / kDegree);
  json["near_m"] = finite(figures.near_m());
  json["far_m"] = finite(figures.far_m());
  json["at"] = nlohmann::json::array();
  for (const double range_m : ranges_m) {
    const RangeFigures at = figures.at(range_m);
    json["at"].push_back({{"range_m", range_m},
                          {"step_out_m", finite(at.step_out_m)},
                          {"step_derivative_m", finite(at.step_derivative_m)},
                          {"signal_dn", finite(at.signal_dn)},
                          {"background_dn", finite(at.background_dn)},
                          {"signal_to_background", finite(at.signal_to_background)},
                          {"snr", finite(at.snr)},
                          {"sigma_m", finite(at.sigma_m)},
                          {"detection", finite(at.detection)},
                          {"clipped", at.is_clipped}});
  }
  json["laser_to_sun"] = finite(figures.laser_to_sun(ranges_m.front()));
  json["shutter_factor"] = figures.shutter_factor();
  json["filter_factor"] = finite(figures.filter_factor());
  json["filter_factor_am15"] = derived_suppression(design);
  json["max_range_m"] = finite(figures.max_range_m());
  json["false_alarm"] = design.false_alarm;
  json["detection"] = design.detection;
  json["scans_per_s"] = figures.scan_rate_hz();
  for (const Requirement& one : figures.requirements())
    json["requirements"].push_back({{"number", one.number},
                                    {"wanted", one.wanted},
                                    {"reached", one.reached},
                                    {"standing", standing_word(one.standing)}});
  return json;
}

std::string design_svg(const DesignFigures& figures) {
  const std::vector<double> ranges_m = plotted_ranges(figures);
  std::vector<Eigen::Vector2d> step, sigma, snr, ratio, found;
  for (const double range_m : ranges_m) {
    const RangeFigures at = figures.at(range_m);
    step.emplace_back(range_m, 1e3 * at.step_out_m);
    sigma.emplace_back(range_m, 1e3 * at.sigma_m);
    snr.emplace_back(range_m, at.snr);
    ratio.emplace_back(range_m, at.signal_to_background);
    found.emplace_back(range_m, 100.0 * at.detection);
  }
  SvgChart errors("Range: one pixel outward, and the predicted error", range_axis(ranges_m),
                  decades("mm", {step, sigma}));
  errors.line("one pixel outward", "#12395c", step);
  errors.line("one sigma", "#c2410c", sigma);
  SvgChart light("Light: over the sun, and over the noise", range_axis(ranges_m),
                 decades("ratio", {snr, ratio}));
  light.line("signal to background", "#12395c", ratio);
  light.line("SNR: signal over noise", "#c2410c", snr);
  SvgChart detection("Detection", range_axis(ranges_m), {"stripe found (%)", 0.0, 105.0, false});
  detection.line("", "#12395c", found);
  return svg_of({errors, light, detection});
}

std::string paper_text() {
  std::string text = "Table 1 of Mertz et al. 2002, s = 50 cm          printed        here\n";
  const auto out = std::back_inserter(text);
  for (const PaperLens& lens : paper_table_1()) {
    fmt::format_to(
        out, "  {:3.0f} degrees  angle of a pixel                {:.2f}           {:.2f} degrees\n",
        lens.fov_deg, lens.printed_resolution_deg, lens.resolution_deg);
    fmt::format_to(out,
                   "               one pixel outward at 2 m        {:.1f}            {:.1f} cm "
                   "(derivative {:.1f})\n",
                   100.0 * lens.printed_step_m, 100.0 * lens.step_m, 100.0 * lens.derivative_m);
    fmt::format_to(out,
                   "               maximum range                   {:.0f}            {:.0f} cm, "
                   "misfit {:+.1f} %\n",
                   100.0 * lens.printed_max_range_m, 100.0 * lens.scaled_max_range_m,
                   100.0 * (lens.scaled_max_range_m / lens.printed_max_range_m - 1.0));
  }
  text +=
      "  The maximum range cannot be had from what is printed: this is a scaling,\n"
      "  range^2 ~ 1 / tan(fov / 2), fitted to 55 degrees, and no reproduction.\n";
  const DesignFigures figures(paper_striper(55.0));
  StriperDesign narrow = figures.design();
  narrow.camera.filter_width_nm = 10.0;
  const double ratio = figures.at(2.0).signal_to_background;
  fmt::format_to(out, "Sun over laser at 2 m                          80 000         {:.0f}\n",
                 1.0 / figures.laser_to_sun(2.0));
  fmt::format_to(
      out,
      "Shutter                                        13 000         {:.0f} (printed truncated)\n",
      figures.shutter_factor());
  fmt::format_to(out,
                 "Filter                                         40             {:.1f} put in; "
                 "{:.1f} from the AM1.5 spectrum\n",
                 figures.filter_factor(), derived_suppression(figures.design()));
  fmt::format_to(out,
                 "Signal to background (the paper's S/N)         about 7        {:.2f}; SNR, "
                 "another thing, {:.1f}\n",
                 ratio, figures.at(2.0).snr);
  fmt::format_to(out, "10 nm instead of 25 nm                         2.5            {:.2f}\n",
                 DesignFigures(narrow).at(2.0).signal_to_background / ratio);
  return text;
}

}  // namespace striper::program
