// SPDX-License-Identifier: Apache-2.0
#include "program/svg_chart.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

namespace striper::program {
namespace {

constexpr double kLeft_px = 74.0;
constexpr double kRight_px = 18.0;
constexpr double kTop_px = 34.0;
constexpr double kBottom_px = 46.0;
constexpr double kTallest_px = 900.0;

double part_of(const ChartAxis& axis, double value) {
  if (!axis.is_logarithmic) return (value - axis.low) / (axis.high - axis.low);
  return std::log(value / axis.low) / std::log(axis.high / axis.low);
}

std::vector<double> linear_ticks(const ChartAxis& axis) {
  const double rough = (axis.high - axis.low) / 7.0;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {5.0, 2.0, 1.0})
    if (factor * power >= rough) step = factor * power;
  std::vector<double> ticks;
  for (double n = std::ceil(axis.low / step); n * step <= axis.high + 1e-9 * step; ++n)
    ticks.push_back(n * step);
  return ticks;
}

std::vector<double> logarithmic_ticks(const ChartAxis& axis) {
  const bool is_short = axis.high / axis.low < 300.0;
  std::vector<double> ticks;
  const auto first = static_cast<int>(std::floor(std::log10(axis.low)));
  const auto last = static_cast<int>(std::floor(std::log10(axis.high)));
  for (int exponent = first; exponent <= last; ++exponent) {
    const double power = std::pow(10.0, exponent);
    for (const double factor : {1.0, 2.0, 5.0})
      if ((is_short || factor == 1.0) && factor * power >= axis.low && factor * power <= axis.high)
        ticks.push_back(factor * power);
  }
  return ticks;
}

}  // namespace

SvgChart::SvgChart(std::string title, ChartAxis x, ChartAxis y, bool equal_scale)
    : title_(std::move(title)), x_(std::move(x)), y_(std::move(y)) {
  if (!equal_scale) return;
  const double per_unit = (kWidth_px - kLeft_px - kRight_px) / (x_.high - x_.low);
  const double wanted_px = std::abs(per_unit * (y_.high - y_.low)) + kTop_px + kBottom_px;
  height_px_ = std::clamp(wanted_px, 260.0, kTallest_px);
  // A unit as long along x as it now is along y.
  const double inside_px = height_px_ - kTop_px - kBottom_px;
  const double wider = std::abs((y_.high - y_.low) / (x_.high - x_.low)) *
                       (kWidth_px - kLeft_px - kRight_px) / inside_px;
  ChartAxis& axis = wider > 1.0 ? x_ : y_;
  const double factor = wider > 1.0 ? wider : 1.0 / wider;
  const double middle = 0.5 * (axis.low + axis.high);
  axis.low = middle + factor * (axis.low - middle);
  axis.high = middle + factor * (axis.high - middle);
}

bool SvgChart::shows(const Eigen::Vector2d& point) const {
  if (!point.allFinite()) return false;
  if ((x_.is_logarithmic && point.x() <= 0.0) || (y_.is_logarithmic && point.y() <= 0.0))
    return false;
  const double u = part_of(x_, point.x());
  const double v = part_of(y_, point.y());
  return u >= 0.0 && u <= 1.0 && v >= 0.0 && v <= 1.0;
}

Eigen::Vector2d SvgChart::place(const Eigen::Vector2d& point) const {
  const double across = kWidth_px - kLeft_px - kRight_px;
  const double up = height_px_ - kTop_px - kBottom_px;
  return {kLeft_px + across * part_of(x_, point.x()),
          kTop_px + up * (1.0 - part_of(y_, point.y()))};
}

void SvgChart::add_key(const std::string& name, const std::string& colour) {
  if (name.empty()) return;
  const double y = kTop_px + 18.0 + 18.0 * keys_++;
  fmt::format_to(std::back_inserter(key_),
                 "<rect x=\"{:.0f}\" y=\"{:.0f}\" width=\"16\" height=\"4\" fill=\"{}\"/>"
                 "<text x=\"{:.0f}\" y=\"{:.0f}\">{}</text>\n",
                 kLeft_px + 12.0, y - 6.0, colour, kLeft_px + 34.0, y, name);
}

void SvgChart::line(const std::string& name, const std::string& colour,
                    const std::vector<Eigen::Vector2d>& points) {
  std::string path;
  bool is_drawing = false;
  for (const Eigen::Vector2d& point : points) {
    if (shows(point)) {
      const Eigen::Vector2d at = place(point);
      fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", is_drawing ? "L" : "M", at.x(),
                     at.y());
    }
    is_drawing = shows(point);
  }
  body_ += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n", path,
                       colour);
  add_key(name, colour);
}

void SvgChart::dots(const std::string& name, const std::string& colour, double radius_px,
                    const std::vector<Eigen::Vector2d>& points) {
  for (const Eigen::Vector2d& point : points) {
    if (!shows(point)) continue;
    const Eigen::Vector2d at = place(point);
    fmt::format_to(std::back_inserter(body_),
                   "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:g}\" fill=\"{}\"/>\n", at.x(), at.y(),
                   radius_px, colour);
  }
  add_key(name, colour);
}

void SvgChart::bars(const std::string& name, const std::string& colour,
                    const std::vector<Eigen::Vector2d>& from,
                    const std::vector<Eigen::Vector2d>& to) {
  for (std::size_t i = 0; i < std::min(from.size(), to.size()); ++i) {
    if (!shows(from[i]) || !shows(to[i])) continue;
    const Eigen::Vector2d a = place(from[i]);
    const Eigen::Vector2d b = place(to[i]);
    fmt::format_to(std::back_inserter(body_),
                   "<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"{}\"/>\n", a.x(), a.y(),
                   b.x(), b.y(), colour);
  }
  add_key(name, colour);
}

std::string SvgChart::grid() const {
  std::string text;
  const auto out = std::back_inserter(text);
  const double bottom_px = height_px_ - kBottom_px;
  for (const double tick : x_.is_logarithmic ? logarithmic_ticks(x_) : linear_ticks(x_)) {
    const double x = kLeft_px + (kWidth_px - kLeft_px - kRight_px) * part_of(x_, tick);
    fmt::format_to(out,
                   "<path d=\"M{0:.1f} {1}V{2}\" stroke=\"#e4e4e4\"/>"
                   "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4:.4g}</text>\n",
                   x, kTop_px, bottom_px, bottom_px + 16.0, std::abs(tick) < 1e-12 ? 0.0 : tick);
  }
  for (const double tick : y_.is_logarithmic ? logarithmic_ticks(y_) : linear_ticks(y_)) {
    const double y = kTop_px + (bottom_px - kTop_px) * (1.0 - part_of(y_, tick));
    fmt::format_to(out,
                   "<path d=\"M{0} {1:.1f}H{2}\" stroke=\"#e4e4e4\"/>"
                   "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.4g}</text>\n",
                   kLeft_px, y, kWidth_px - kRight_px, kLeft_px - 6.0, y + 4.0,
                   std::abs(tick) < 1e-12 ? 0.0 : tick);
  }
  return text;
}

std::string SvgChart::group(double top_px) const {
  const double bottom_px = height_px_ - kBottom_px;
  const double middle_px = 0.5 * (kTop_px + bottom_px);
  return fmt::format(
      "<g transform=\"translate(0 {})\">\n{}{}"
      "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#888888\"/>\n{}"
      "<text x=\"{}\" y=\"20\" text-anchor=\"middle\" font-size=\"15\">{}</text>\n"
      "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n"
      "<text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n</g>\n",
      top_px, grid(), body_, kLeft_px, kTop_px, kWidth_px - kLeft_px - kRight_px,
      bottom_px - kTop_px, key_, 0.5 * kWidth_px, title_, 0.5 * kWidth_px, height_px_ - 10.0,
      x_.label, middle_px, y_.label);
}

std::string svg_of(const std::vector<SvgChart>& charts) {
  double height_px = 0.0;
  std::string groups;
  for (const SvgChart& chart : charts) {
    groups += chart.group(height_px);
    height_px += chart.height_px();
  }
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" "
      "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{2}</svg>\n",
      SvgChart::kWidth_px, height_px, groups);
}

}  // namespace striper::program
