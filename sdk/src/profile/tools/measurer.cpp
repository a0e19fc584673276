// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/profile/tools.hpp>

#include "profile/cutter.hpp"
#include "profile/tools/calibration_modes.hpp"
#include "profile/tools/tool_rows.hpp"
#include "profile/tools/tool_values.hpp"

namespace striper {
namespace {

using detail::CalibrationModes;
using detail::InverseRanges;
using detail::Patch;
using detail::Patches;
using detail::ToolValues;

// A mode of the calibration that moves a tool's value by this little of a sigma each way is enough
// for its derivative, and small against what bends.
constexpr double kModeStep = 0.5;

// What belongs to one laser of the model.
struct LaserGeometry {
  Eigen::Vector2d pivot_m{0.0, 0.0};
  std::unique_ptr<CalibrationModes> modes;  // Null without a covariance.
};

// Whether a return is so far from the sensor's border that the camera sees on beyond it.
bool is_inside(const StriperModel* model, const PolarScan& scan, const Return& r) {
  if (model == nullptr) return false;
  const bool is_columns = scan.axis == StripeAxis::kColumns;
  const double at = r.along_px(scan.axis);
  const int size = is_columns ? model->camera.width() : model->camera.height();
  constexpr double kBorder = 1.5;  // A spacing, and what a binned column may be off.
  return at > kBorder && at < size - 1 - kBorder;
}

}  // namespace

struct Measurer::Impl {
  void name_rows();
  const LaserGeometry& geometry_of(int laser);
  detail::SeenBeyond seen_beyond(const PolarScan& scan) const;
  void measure(const PolarScan& scan);
  void measure(const MeasureTool& tool, const Patches& pieces, Measurement* rows);
  void add_calibration(const MeasureTool& tool, const Patches& pieces, const ToolValues& values,
                       Measurement* rows);

  std::vector<MeasureTool> tools;
  std::shared_ptr<const StriperModel> model;
  SegmentOptions options;
  std::map<int, LaserGeometry> lasers;
  std::vector<std::string> names;

  detail::Cutter cutter;
  Segmentation segmentation;
  CalibrationModes* modes = nullptr;  // Of the scan in work; null where they are not known.
  std::vector<Patch> patches;
  InverseRanges moved;
  std::vector<Measurement> measurements;
};

Measurer::Measurer(std::vector<MeasureTool> tools, std::shared_ptr<const StriperModel> model,
                   const SegmentOptions& options)
    : impl_(std::make_unique<Impl>()) {
  options.validate();
  impl_->tools = std::move(tools);
  impl_->model = std::move(model);
  impl_->options = options;
  for (const MeasureTool& tool : impl_->tools) detail::require_regions(tool);
  impl_->name_rows();
}
Measurer::Measurer(Measurer&&) noexcept = default;
Measurer& Measurer::operator=(Measurer&&) noexcept = default;
Measurer::~Measurer() = default;

const std::vector<std::string>& Measurer::rows() const noexcept { return impl_->names; }

const std::vector<Measurement>& Measurer::measure(const PolarScan& scan) {
  impl_->measure(scan);
  return impl_->measurements;
}

void Measurer::Impl::name_rows() {
  for (const MeasureTool& tool : tools) {
    const detail::ToolWords& words = detail::tool_words(tool.kind);
    for (std::size_t k = 0; k < words.row_count(); ++k)
      names.push_back(fmt::format("{}.{}", tool.name, words.rows[k].name));
    const auto is_same = [&](const MeasureTool& other) { return other.name == tool.name; };
    if (std::count_if(tools.begin(), tools.end(), is_same) > 1)
      throw Error(ErrorKind::kUsage, fmt::format("tool '{}' is there twice", tool.name));
  }
}

const LaserGeometry& Measurer::Impl::geometry_of(int laser) {
  const auto [found, is_new] = lasers.try_emplace(laser);
  LaserGeometry& geometry = found->second;
  if (!is_new) return geometry;
  geometry.pivot_m = options_for(model.get(), laser, options).pivot_m;
  if (!model || laser >= static_cast<int>(model->lasers.size())) return geometry;
  const Triangulator triangulator(*model, laser);
  if (triangulator.has_covariance())
    geometry.modes = std::make_unique<CalibrationModes>(triangulator);
  return geometry;
}

detail::SeenBeyond Measurer::Impl::seen_beyond(const PolarScan& scan) const {
  const InverseRanges& ranges = cutter.ranges;
  if (ranges.size() == 0) return {};
  const std::size_t first = ranges.index.front();
  const std::size_t last = ranges.index.back();
  return {first > 0 || is_inside(model.get(), scan, scan.returns[first]),
          last + 1 < scan.returns.size() || is_inside(model.get(), scan, scan.returns[last])};
}

void Measurer::Impl::measure(const PolarScan& scan) {
  const LaserGeometry& geometry = geometry_of(scan.laser);
  SegmentOptions here = options;
  here.pivot_m = geometry.pivot_m;
  here.find_circles = false;  // Tools tell themselves what is one.
  cutter.cut(scan, here, segmentation);
  modes =
      geometry.modes && geometry.modes->take(scan, cutter.ranges) ? geometry.modes.get() : nullptr;
  const Patches pieces(cutter.ranges, cutter.runs, seen_beyond(scan));
  measurements.assign(names.size(), {});
  std::size_t row = 0;
  for (const MeasureTool& tool : tools) {
    const detail::ToolWords& words = detail::tool_words(tool.kind);
    for (std::size_t k = 0; k < words.row_count(); ++k) {
      measurements[row + k].tool = names[row + k];
      measurements[row + k].unit = words.rows[k].unit;
    }
    measure(tool, pieces, &measurements[row]);
    row += words.row_count();
  }
}

void Measurer::Impl::measure(const MeasureTool& tool, const Patches& pieces, Measurement* rows) {
  const MeasureStatus status = pieces.find(tool, patches);
  const std::size_t count = detail::tool_words(tool.kind).row_count();
  ToolValues values;
  if (status == MeasureStatus::kOk)
    values = detail::values_of(tool, cutter.ranges, pieces, patches);
  for (std::size_t k = 0; k < count; ++k) {
    rows[k].status = status == MeasureStatus::kOk ? values[k].status : status;
    if (rows[k].status != MeasureStatus::kOk) continue;
    rows[k].value = values[k].value;
    rows[k].sigma = std::sqrt(values[k].variance);
    rows[k].points = detail::points_of(tool.kind, patches);
  }
  if (status == MeasureStatus::kOk && modes != nullptr) add_calibration(tool, pieces, values, rows);
}

// Measures again with the calibration wrong by each of its modes.
void Measurer::Impl::add_calibration(const MeasureTool& tool, const Patches& pieces,
                                     const ToolValues& values, Measurement* rows) {
  std::array<double, detail::kMostRows> variance{};
  for (std::size_t k = 0; k < modes->count(); ++k) {
    modes->move(cutter.ranges, k, kModeStep, moved);
    const ToolValues more = detail::values_of(tool, moved, pieces, patches);
    modes->move(cutter.ranges, k, -kModeStep, moved);
    const ToolValues less = detail::values_of(tool, moved, pieces, patches);
    for (std::size_t row = 0; row < variance.size(); ++row) {
      double change = more[row].value - less[row].value;
      if (rows[0].unit == "rad" || (tool.kind == ToolKind::kLine && row == 1))
        change = std::remainder(change, 2.0 * std::numbers::pi);
      variance[row] += std::pow(change / (2.0 * kModeStep), 2.0);
    }
  }
  for (std::size_t row = 0; row < detail::tool_words(tool.kind).row_count(); ++row)
    if (values[row].status == MeasureStatus::kOk) rows[row].sigma_cal = std::sqrt(variance[row]);
}

}  // namespace striper
