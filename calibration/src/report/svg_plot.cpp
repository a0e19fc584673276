// SPDX-License-Identifier: Apache-2.0
#include "report/svg_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

namespace striper::detail {
namespace {

constexpr double kLeft = 52.0;
constexpr double kBottom = 36.0;
constexpr double kOther = 10.0;

double tick_step(double span) {
  const double rough = span / 6.0;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= rough) return factor * power;
  return 10.0 * power;
}

}  // namespace

SvgPlot::SvgPlot(int width_px, int height_px, const Eigen::AlignedBox2d& box, bool y_down)
    : width_(width_px), height_(height_px), box_(box), y_down_(y_down) {
  ticks();
}

void SvgPlot::labels(std::string_view x, std::string_view y) {
  x_label_ = escape_html(x);
  y_label_ = escape_html(y);
}

Eigen::Vector2d SvgPlot::place(const Eigen::Vector2d& at) const {
  const Eigen::Vector2d unit = (at - box_.min()).cwiseQuotient(box_.sizes());
  const double y = y_down_ ? unit.y() : 1.0 - unit.y();
  return {kLeft + unit.x() * (width_ - kLeft - kOther), kOther + y * (height_ - kBottom - kOther)};
}

void SvgPlot::ticks() {
  const auto out = std::back_inserter(body_);
  const Eigen::Vector2d low = place(box_.min()).cwiseMin(place(box_.max()));
  const Eigen::Vector2d high = place(box_.min()).cwiseMax(place(box_.max()));
  fmt::format_to(out,
                 "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
                 "class=\"frame\"/>",
                 low.x(), low.y(), high.x() - low.x(), high.y() - low.y());
  for (const int axis : {0, 1}) {
    const double step = tick_step(box_.sizes()[axis]);
    const auto last = std::lround(std::floor(box_.max()[axis] / step + 1e-9));
    for (auto tick = std::lround(std::ceil(box_.min()[axis] / step)); tick <= last; ++tick) {
      const double t = static_cast<double>(tick) * step;
      Eigen::Vector2d at = box_.min();
      at[axis] = t;
      const Eigen::Vector2d p = place(at);
      if (axis == 0)
        fmt::format_to(out,
                       "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.4g}</text>"
                       "<path d=\"M{:.1f} {:.1f}V{:.1f}\" class=\"grid\"/>",
                       p.x(), high.y() + 14.0, t, p.x(), low.y(), high.y());
      else
        fmt::format_to(out,
                       "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{:.4g}</text>"
                       "<path d=\"M{:.1f} {:.1f}H{:.1f}\" class=\"grid\"/>",
                       low.x() - 4.0, p.y() + 4.0, t, low.x(), p.y(), high.x());
    }
  }
}

void SvgPlot::dot(const Eigen::Vector2d& at, double radius_px, std::string_view colour) {
  if (!at.allFinite() || !box_.contains(at)) return;
  const Eigen::Vector2d p = place(at);
  fmt::format_to(std::back_inserter(body_),
                 "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\"/>", p.x(), p.y(),
                 radius_px, colour);
}

void SvgPlot::line(const std::vector<Eigen::Vector2d>& points, std::string_view colour,
                   double width_px) {
  if (points.size() < 2) return;
  std::string path;
  for (const Eigen::Vector2d& point : points) {
    const Eigen::Vector2d p = place(point.cwiseMax(box_.min()).cwiseMin(box_.max()));
    fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", path.empty() ? "M" : "L", p.x(),
                   p.y());
  }
  fmt::format_to(std::back_inserter(body_),
                 "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"/>", path, colour,
                 width_px);
}

void SvgPlot::rectangle(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                        std::string_view fill) {
  const Eigen::Vector2d a = place(low).cwiseMin(place(high));
  const Eigen::Vector2d b = place(low).cwiseMax(place(high));
  fmt::format_to(std::back_inserter(body_),
                 "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>",
                 a.x(), a.y(), b.x() - a.x() + 0.3, b.y() - a.y() + 0.3, fill);
}

void SvgPlot::text(const Eigen::Vector2d& at, std::string_view words) {
  const Eigen::Vector2d p = place(at);
  fmt::format_to(std::back_inserter(body_),
                 "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"mark\">{}</text>",
                 p.x(), p.y(), escape_html(words));
}

std::string SvgPlot::finish() const {
  return fmt::format(
      "<svg width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\">{2}"
      "<text x=\"{3}\" y=\"{4}\" text-anchor=\"middle\">{5}</text>"
      "<text transform=\"translate(12 {6}) rotate(-90)\" text-anchor=\"middle\">{7}</text></svg>\n",
      width_, height_, body_, 0.5 * (width_ + kLeft), height_ - 4, x_label_,
      0.5 * (height_ - kBottom), y_label_);
}

std::string heat_colour(double value) {
  // Anchors of a map that grows lighter throughout, so that it reads in grey too.
  static constexpr std::array<std::array<double, 3>, 5> kAnchors = {
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double t = std::clamp(value, 0.0, 1.0) * (kAnchors.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(t), kAnchors.size() - 2);
  const double f = t - static_cast<double>(i);
  const auto mix = [&](std::size_t c) {
    return static_cast<int>(
        std::lround(kAnchors[i][c] + f * (kAnchors[i + 1][c] - kAnchors[i][c])));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2));
}

std::string escape_html(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

}  // namespace striper::detail
