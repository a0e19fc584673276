// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/report/report.hpp>

#include "report/picture_marks.hpp"
#include "report/svg_plot.hpp"

namespace striper {
namespace {

using detail::escape_html;
using detail::SvgPlot;

constexpr const char* kGreen = "#2a9d5c";
constexpr const char* kBlue = "#2b6cb0";
constexpr const char* kOrange = "#dd7a1e";
constexpr const char* kGrey = "#999999";
constexpr std::size_t kMostOutliersShown = 24;

constexpr const char* kStyle = R"(<style>
body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:0 auto;padding:0 16px 60px;color:#222}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em;border-bottom:1px solid #ddd}
.verdict{padding:14px 18px;border-radius:8px;font-size:1.15em;color:#fff}
.good{background:#23804a}.warn{background:#b86a10}.bad{background:#b3261e}
table{border-collapse:collapse;margin:.5em 0}td,th{padding:3px 12px;text-align:left;border-bottom:1px solid #eee;vertical-align:top}
td.n{text-align:right;font-variant-numeric:tabular-nums}
svg text{font:11px system-ui,sans-serif;fill:#444}svg .mark{fill:#fff;font-weight:600;paint-order:stroke;stroke:#0008;stroke-width:2px}
.frame{fill:none;stroke:#888}.grid{stroke:#0001;fill:none}
.row{display:flex;flex-wrap:wrap;gap:18px;align-items:flex-start}.row>div:not([class]){width:min-content}.card{width:320px;font-size:12.5px;line-height:1.35;overflow-wrap:anywhere}
.small{color:#666;font-size:13px}.refusal{color:#b3261e;font-weight:600}.warning{color:#b86a10;font-weight:600}
</style>)";

std::string mm(double metres) {
  return std::isfinite(metres) ? fmt::format("{:.2f} mm", 1e3 * metres) : std::string("–");
}

std::string figure(double value, const char* unit = "") {
  return std::isfinite(value) ? fmt::format("{:.2g}{}", value, unit) : std::string("–");
}

std::string px(double pixels) {
  return std::isfinite(pixels) ? fmt::format("{:.3f} px", pixels) : std::string("–");
}

std::string file_name(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

class Report {
 public:
  explicit Report(const Calibration& calibration)
      : c_(calibration), s_(calibration.solution), o_(calibration.observations) {}

  std::string write() {
    html_ = "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Calibration</title>";
    html_ += kStyle;
    verdict();
    advice();
    figures();
    for (std::size_t laser = 0; laser < c_.model.lasers.size(); ++laser) range_error(laser);
    coverage();
    residuals();
    cross_validation();
    outliers();
    images();
    return std::move(html_) + "</html>\n";
  }

 private:
  template <typename... Args>
  void add(fmt::format_string<Args...> text, Args&&... args) {
    fmt::format_to(std::back_inserter(html_), text, std::forward<Args>(args)...);
  }

  void verdict() {
    const auto severity = worst(c_.findings);
    const char* colour = severity == Severity::kRefusal   ? "bad"
                         : severity == Severity::kWarning ? "warn"
                                                          : "good";
    add("<h1>Calibration of a striper</h1><p class=\"verdict {}\">{}{}</p>", colour,
        escape_html(c_.verdict()),
        c_.forced ? " <b>The model was written all the same, because it was asked for by force.</b>"
                  : "");
    add("<p>{} board images used of {}, {} stripes; corners fit to <b>{:.3f} px</b> rms",
        o_.views.size(), c_.images.size(), o_.stripes.size(), s_.corners.rms_px);
    if (!o_.stripes.empty()) add(", stripes to <b>{:.3f} px</b> rms", s_.stripes.rms_px);
    const BoardDistances boards = c_.board_distances();
    add(". The boards were {:.2f} to {:.2f} m away, median {:.2f} m. It took {:.1f} s.</p>",
        boards.nearest_m, boards.farthest_m, boards.median_m, c_.seconds);
  }

  void advice() {
    if (c_.findings.empty()) return;
    add("<h2>What was found, and what to do about it</h2><table>");
    for (const Event& f : c_.findings) {
      const std::string_view severity = to_string(f.severity);
      add("<tr><td class=\"{0}\">{0}</td><td>{1}</td><td>{2}</td></tr>", severity,
          escape_html(f.message), escape_html(f.advice));
    }
    add("</table>");
  }

  double sigma(Eigen::Index i) const {
    return s_.covariance.size() > 0 ? std::sqrt(s_.covariance(i, i)) : NAN;
  }

  void figures() {
    add("<h2>The model</h2><div class=\"row\"><table><tr><th>camera</th><th>value</th><th>one "
        "sigma</th></tr>");
    const Eigen::VectorXd values = c_.model.camera.parameters();
    const auto names = c_.model.camera.parameter_names();
    for (Eigen::Index i = 0; i < values.size(); ++i)
      add("<tr><td>{}</td><td class=\"n\">{:.5g}</td><td class=\"n\">{}</td></tr>",
          names[static_cast<std::size_t>(i)], values[i],
          sigma(i) == 0.0 ? "held" : figure(sigma(i)));
    add("</table>");
    for (std::size_t p = 0; p < c_.model.lasers.size(); ++p) {
      const LaserPlane& plane = c_.model.lasers[p].plane;
      const Eigen::Index at = values.size() + 4 * static_cast<Eigen::Index>(p);
      add("<table><tr><th>laser {}</th><th>value</th><th>one sigma</th></tr>", p);
      for (int k = 0; k < 3; ++k)
        add("<tr><td>normal {}</td><td class=\"n\">{:.5f}</td><td class=\"n\">{}</td></tr>",
            "xyz"[k], plane.normal()[k], figure(sigma(at + k) * 57.29578, "°"));
      add("<tr><td>distance</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>",
          mm(plane.distance_m()), mm(sigma(at + 3)));
      add("</table>");
    }
    lens_trials();
    add("</div>");
    if (!o_.stripes.empty()) compared_settings();
    if (c_.bend_solved)
      add("<p>The board's bend was solved for: its middle stands {} (across) and {} (down) off its "
          "ends.</p>",
          mm(s_.bend_m.x()), mm(s_.bend_m.y()));
  }

  void compared_settings() {
    add("<p>The stripe is read as: {}; single frames are searched in channel {}.</p><table><tr>"
        "<th>read as</th><th>stripes</th><th>on the plane</th><th>rms</th></tr>",
        escape_html(to_string(c_.settings)), to_string(c_.model.channel));
    for (const SettingsScore& score : c_.compared_settings)
      add("<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>"
          "</tr>",
          escape_html(to_string(score.settings)), score.stripes, score.on_plane, px(score.rms_px));
    add("</table>");
  }

  void lens_trials() {
    if (c_.lens.trials.empty()) return;
    add("<table><tr><th>lens</th><th>fit</th><th>held-out views</th></tr>");
    for (const LensTrial& trial : c_.lens.trials) {
      const bool chosen = trial.lens == c_.lens.lens && trial.hold_k3 == c_.lens.hold_k3;
      const char* remark = chosen                             ? " (chosen)"
                           : std::isfinite(trial.held_out_px) ? ""
                                                              : " (not determined by these images)";
      add("<tr><td>{}{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td></tr>", trial.name(),
          remark, px(trial.rms_px), px(trial.held_out_px));
    }
    add("</table>");
  }

  void range_error(std::size_t laser) {
    add("<h2>Laser {}: the range error that the calibration leaves</h2>", laser);
    const auto [near_m, far_m] = c_.depths_m[laser];
    if (!(far_m > 0.0)) return;
    add("<p>The stripe was seen on the boards at ranges of {:.2f} to {:.2f} m; beyond them the "
        "figures extrapolate.</p><div class=\"row\">",
        near_m, far_m);
    add("<table><tr><th>range</th><th>one sigma</th><th></th></tr>");
    for (const RangeSigma& at : c_.range_sigmas[laser])
      add("<tr><td class=\"n\">{:g} m</td><td class=\"n\">{}</td><td>{}</td></tr>", at.range_m,
          mm(at.sigma_m),
          std::isfinite(at.sigma_m) ? (at.inside_data ? "" : "extrapolated") : "not in the image");
    add("</table>");
    if (c_.model.covariance) map(static_cast<int>(laser));
    add("</div>");
  }

  void map(int laser) {
    const RangeMap map = range_map(c_.model, laser, 48, 36);
    std::vector<double> finite;
    for (const double sigma_m : map.sigma_m)
      if (std::isfinite(sigma_m) && sigma_m > 0.0) finite.push_back(std::log10(sigma_m));
    if (finite.empty()) return;
    std::sort(finite.begin(), finite.end());
    const double low = finite[finite.size() / 50];
    const double high = std::max(finite[finite.size() - 1 - finite.size() / 20], low + 0.1);
    SvgPlot plot = image_plot(560);
    const Eigen::Vector2d cell(static_cast<double>(o_.image_width) / map.columns,
                               static_cast<double>(o_.image_height) / map.rows);
    for (int row = 0; row < map.rows; ++row)
      for (int column = 0; column < map.columns; ++column) {
        const double sigma_m = map.sigma_m[static_cast<std::size_t>(row * map.columns + column)];
        if (!std::isfinite(sigma_m)) continue;
        const Eigen::Vector2d corner = cell.cwiseProduct(Eigen::Vector2d(column, row));
        plot.rectangle(corner, corner + cell,
                       detail::heat_colour((std::log10(sigma_m) - low) / (high - low)));
      }
    // Figures on the map: range and sigma.
    for (int row = 3; row < map.rows; row += 6)
      for (int column = 8; column < map.columns; column += 16) {
        const auto i = static_cast<std::size_t>(row * map.columns + column);
        if (!std::isfinite(map.sigma_m[i])) continue;
        plot.text(cell.cwiseProduct(Eigen::Vector2d(column + 0.5, row + 0.5)),
                  fmt::format("{:.3g} m ±{:.2g} mm", map.range_m[i], 1e3 * map.sigma_m[i]));
      }
    plot.labels("u, px", "v, px");
    add("<div>{}<p class=\"small\">Dark is good: one-sigma range error from the calibration for "
        "every pixel (logarithmic); white: the ray does not meet the laser plane.</p></div>",
        plot.finish());
  }

  SvgPlot image_plot(int width) const {
    const Eigen::AlignedBox2d box(Eigen::Vector2d(0, 0),
                                  Eigen::Vector2d(o_.image_width, o_.image_height));
    const int height = 46 + (width - 62) * o_.image_height / std::max(1, o_.image_width);
    return {width, height, box, true};
  }

  void coverage() {
    add("<h2>Coverage</h2><div class=\"row\">");
    SvgPlot plot = image_plot(500);
    for (const CornerView& view : o_.views)
      for (const auto& p : view.pixel) plot.dot(p, 1.4, kBlue);
    for (const StripeView& stripe : o_.stripes)
      for (const auto& p : stripe.pixel) plot.dot(p, 1.0, kOrange);
    plot.labels("u, px", "v, px");
    add("<div>{}<p class=\"small\">Corners (blue) and stripes (orange) in the image. White areas "
        "are extrapolated.</p></div>",
        plot.finish());
    for (std::size_t laser = 0; laser < c_.model.lasers.size(); ++laser)
      plane_view(static_cast<int>(laser));
    tilt_view();
    add("</div>");
  }

  void plane_view(int laser) {
    const Eigen::Isometry3d T_scan_cam = c_.model.T_cam_scan(laser).inverse();
    std::vector<Eigen::Vector2d> points;
    Eigen::AlignedBox2d box(Eigen::Vector2d(0, 0), Eigen::Vector2d(0.1, 0.1));
    for (const auto& p : stripe_points_cam(o_, s_, laser)) {
      const Eigen::Vector3d q = T_scan_cam * p;
      points.emplace_back(-q.y(), q.x());
      box.extend(points.back());
    }
    const Eigen::Vector2d grow = 0.06 * box.sizes();
    box.extend(box.max() + grow);
    box.extend(box.min() - grow);
    SvgPlot plot(420, 380, box, false);
    for (const auto& p : points) plot.dot(p, 1.2, kOrange);
    plot.dot({0, 0}, 4.0, kGreen);
    plot.labels("to the right, m", "forward, m");
    add("<div>{}<p class=\"small\">Laser {}: where in its plane the boards were (green: the scan "
        "origin).</p></div>",
        plot.finish(), laser);
  }

  void tilt_view() {
    const Eigen::AlignedBox2d box(Eigen::Vector2d(-60, -60), Eigen::Vector2d(60, 60));
    SvgPlot plot(340, 340, box, true);
    for (const auto& T : s_.T_cam_board) {
      const Eigen::Vector3d n = T.linear().col(2);
      plot.dot(57.29578 * Eigen::Vector2d(std::atan2(n.x(), n.z()), std::atan2(n.y(), n.z())), 3.5,
               kBlue);
    }
    plot.labels("turned left or right, degrees", "turned up or down, degrees");
    add("<div>{}<p class=\"small\">How the boards were tilted: spread them over ±30 to 45 degrees "
        "both ways.</p></div>",
        plot.finish());
  }

  void residuals() {
    add("<h2>Residuals</h2><div class=\"row\">");
    const double reach = std::max(0.2, 4.0 * s_.corners.sigma_px);
    SvgPlot scatter(340, 340, {Eigen::Vector2d(-reach, -reach), Eigen::Vector2d(reach, reach)},
                    true);
    for (const auto& view : s_.corner_residual_px)
      for (const auto& r : view) scatter.dot(r, 1.3, kBlue);
    scatter.labels("du, px", "dv, px");
    add("<div>{}<p class=\"small\">Corners: observed minus predicted. It should be a round cloud; "
        "rms {:.3f} px.</p></div>",
        scatter.finish(), s_.corners.rms_px);
    SvgPlot field = image_plot(500);
    const double enlarge = 0.06 * o_.image_width / std::max(3.0 * s_.corners.sigma_px, 1e-3);
    for (std::size_t v = 0; v < o_.views.size(); ++v)
      for (std::size_t i = 0; i < o_.views[v].pixel.size(); ++i) {
        const Eigen::Vector2d r = s_.corner_residual_px[v][i];
        if (r.allFinite())
          field.line({o_.views[v].pixel[i], o_.views[v].pixel[i] + enlarge * r}, kBlue, 0.8);
      }
    field.labels("u, px", "v, px");
    add("<div>{}<p class=\"small\">The same where they are, {:.0f} times enlarged. Neighbours that "
        "point the same way show what the lens model misses.</p></div>",
        field.finish(), enlarge);
    if (!o_.stripes.empty()) stripe_residuals();
    add("</div>");
  }

  void stripe_residuals() {
    const bool columns = o_.axis == StripeAxis::kColumns;
    const double reach = std::max(0.1, 5.0 * s_.stripes.rms_px);
    SvgPlot plot(500, 260,
                 {Eigen::Vector2d(0, -reach),
                  Eigen::Vector2d(columns ? o_.image_width : o_.image_height, reach)},
                 false);
    for (std::size_t k = 0; k < o_.stripes.size(); ++k)
      for (std::size_t i = 0; i < o_.stripes[k].pixel.size(); ++i) {
        const auto& p = o_.stripes[k].pixel[i];
        plot.dot({columns ? p.x() : p.y(), s_.stripe_residual_px[k][i]}, 1.2, kOrange);
      }
    plot.labels(columns ? "column u, px" : "row v, px", "off the plane, px");
    add("<div>{}<p class=\"small\">Stripes: distance from where plane and board meet, rms {:.3f} "
        "px ({:.2f} times what the extraction promised).</p></div>",
        plot.finish(), s_.stripes.rms_px, s_.stripes.sigma_factor);
  }

  void cross_validation() {
    const CrossValidation& v = c_.validation;
    add("<h2>Cross-validation</h2>");
    if (v.splits > 0)
      add("<p>Two halves of the images, calibrated apart, differ by a NEES of <b>{:.1f}</b>; if "
          "the error bars are right it lies between {:.1f} and {:.1f} in 95 of 100 cases (mean of "
          "{} "
          "splits). {}</p>",
          v.nees, v.nees_low, v.nees_high, v.splits,
          v.covariance_factor > 1.0
              ? fmt::format("All error bars were therefore widened by {:.2f}.",
                            std::sqrt(v.covariance_factor))
              : "The error bars hold.");
    else
      add("<p>There are too few images to calibrate two halves of them.</p>");
    if (v.held_out_corner_px.empty()) return;
    double top = 0.1;
    for (std::size_t i = 0; i < o_.views.size(); ++i)
      for (const double value : {v.held_out_corner_px[i], s_.view_rms_px(i)})
        if (std::isfinite(value)) top = std::max(top, 1.1 * value);
    const double count = static_cast<double>(o_.views.size());
    SvgPlot plot(760, 240, {Eigen::Vector2d(-0.5, 0), Eigen::Vector2d(count - 0.5, top)}, false);
    for (std::size_t i = 0; i < o_.views.size(); ++i) {
      const auto x = static_cast<double>(i);
      plot.rectangle({x - 0.38, 0.0}, {x, s_.view_rms_px(i)}, kGrey);
      if (std::isfinite(v.held_out_corner_px[i]))
        plot.rectangle({x, 0.0}, {x + 0.38, v.held_out_corner_px[i]}, kBlue);
    }
    plot.labels("image, the first is 0", "corners, px rms");
    add("{}<p class=\"small\">Every image as part of the fit (grey) and predicted from the "
        "others "
        "(blue; its pose is solved).</p>",
        plot.finish());
  }

  void outliers() {
    if (s_.outliers.empty()) return;
    std::vector<OutlierPoint> sorted = s_.outliers;
    std::sort(sorted.begin(), sorted.end(),
              [](const auto& a, const auto& b) { return a.residual_px > b.residual_px; });
    add("<h2>Outliers</h2><p>{} points were left out. The worst:</p><div class=\"row\">",
        sorted.size());
    if (sorted.size() > kMostOutliersShown) sorted.resize(kMostOutliersShown);
    for (const OutlierPoint& outlier : sorted) {
      const auto k = static_cast<std::size_t>(outlier.view);
      const std::string& name = outlier.is_stripe ? o_.stripes[k].name : o_.views[k].name;
      add("<div style=\"width:140px\" class=\"small\">{}<br>{} {}: {:.2f} px</div>",
          detail::outlier_crop(c_, outlier), escape_html(file_name(name)),
          outlier.is_stripe ? "stripe" : "corner", outlier.residual_px);
    }
    add("</div>");
  }

  void images() {
    add("<h2>The images</h2><p class=\"small\">Green: corners; red: corners that the stripe or a "
        "glare hides; blue: where the stripe was used.</p><div class=\"row\">");
    for (const ImageResult& result : c_.images) {
      add("<div class=\"card\">{}<br><b>{}</b>", detail::thumbnail(c_, result),
          escape_html(file_name(result.laser >= 0 ? result.lit.name : result.image.name)));
      if (result.view >= 0)
        add("<br>board: {:.3f} px rms, squares of {:.0f} px",
            s_.view_rms_px(static_cast<std::size_t>(result.view)), result.board.square_px);
      else
        add("<br><span class=\"refusal\">board not used:</span> {}",
            escape_html(result.board_reason));
      if (result.stripe_view >= 0)
        add("<br>stripe of laser {}: {:.3f} px rms, {} returns, {:.1f} px wide, {:.0f} DN",
            result.laser, s_.stripe_rms_px(static_cast<std::size_t>(result.stripe_view)),
            result.stripe.on_line, result.stripe.width_px, result.stripe.amplitude_dn);
      else if (result.laser >= 0)
        add("<br><span class=\"warning\">stripe not used:</span> {}",
            escape_html(result.stripe_reason.empty() ? "no board" : result.stripe_reason));
      add("</div>");
    }
    add("</div>");
  }

  const Calibration& c_;
  const JointSolution& s_;
  const Observations& o_;
  std::string html_;
};

}  // namespace

std::string format_report(const Calibration& calibration) { return Report(calibration).write(); }

void save_report(const Calibration& calibration, const std::filesystem::path& path) {
  write_file_atomically(path, format_report(calibration));
}

}  // namespace striper
