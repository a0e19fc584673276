// SPDX-License-Identifier: Apache-2.0
// The image of a laser's stripe: each pixel near it is cut into 4 x 4 cells, each cell's ray is
// cast, the Gaussian across the laser plane is averaged over the cell in closed form, and the
// cell's light is spread over the pixels by the lens blur.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "light/gaussian_integral.hpp"
#include "view/view.hpp"

namespace striper::detail {
namespace {

constexpr int kCells = 4;  // Per pixel and axis.
constexpr double kCell = 1.0 / kCells;
constexpr int kTaps = 5;  // Pixels that a cell's ray is interpolated from, per axis.
constexpr double kReachSigmas = 5.5;

/// Shares of a cell's light among the pixels around its own, in one axis: the pixel's box under the
/// lens blur. The cell's own width, over which its light is already spread, is taken out of the
/// blur, so that the whole is exactly Gaussian * Gaussian * pixel.
class CellSpread {
 public:
  explicit CellSpread(double blur_sigma_px) {
    const double variance = blur_sigma_px * blur_sigma_px - kCell * kCell / 12.0;
    if (variance <= 0.0) {
      for (auto& cell : shares_) cell = {1.0};
      return;
    }
    const double sigma = std::sqrt(variance);
    reach_ = static_cast<int>(std::ceil(5.0 * sigma + 0.5));
    for (int i = 0; i < kCells; ++i) {
      for (int pixel = -reach_; pixel <= reach_; ++pixel) {
        const double away = pixel - cell_center(i);
        shares_[static_cast<std::size_t>(i)].push_back(normal_cdf((away + 0.5) / sigma) -
                                                       normal_cdf((away - 0.5) / sigma));
      }
    }
  }

  int reach() const noexcept { return reach_; }
  double share(int cell, int pixel) const noexcept {
    const int index = pixel + reach_;
    return shares_[static_cast<std::size_t>(cell)][static_cast<std::size_t>(index)];
  }

  /// Where a cell's middle is, from the pixel's centre, in pixels.
  static double cell_center(int cell) noexcept { return (cell + 0.5) * kCell - 0.5; }

 private:
  int reach_ = 0;
  std::array<std::vector<double>, kCells> shares_;
};

using Cells = std::array<std::array<double, kCells>, kCells>;  // [down][across]

class StripePainter {
 public:
  StripePainter(const View& view, const Beam& beam, int laser)
      : view_(view),
        beam_(beam),
        laser_(laser),
        region_(view.rays().region()),
        spread_(view.scene().imager.blur_sigma_px),
        near_plane_(beam.casters(view.world())),
        casters_(static_cast<std::size_t>(view.tiles().sight_count())),
        electrons_(region_.height, region_.width, CV_64FC1, cv::Scalar(0.0)) {
    find_heights();
  }

  cv::Mat paint() {
    for (int row = 0; row < region_.height; ++row) {
      for (int column = 0; column < region_.width; ++column) {
        if (is_near_stripe(column, row)) paint_pixel(column, row);
      }
    }
    cv::Mat result;
    electrons_.convertTo(result, CV_32F);
    return result;
  }

 private:
  /// Bounds of the distance from the laser plane, in sigmas of its thickness: where the bounds of a
  /// pixel and its neighbours reach across zero, the stripe may be.
  void find_heights() {
    heights_.reserve(static_cast<std::size_t>(region_.area()));
    for (int v = region_.y; v < region_.y + region_.height; ++v) {
      for (int u = region_.x; u < region_.x + region_.width; ++u) {
        const Hit& hit = view_.hit(u, v);
        double height = std::numeric_limits<double>::quiet_NaN();
        if (hit.found()) {
          const Eigen::Vector3d point = hit.t * view_.rays().at(u, v).homogeneous();
          height = beam_.height_m(point) / beam_.sigma_m(point);
        }
        heights_.push_back(height);
      }
    }
  }

  bool is_near_stripe(int column, int row) const noexcept {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (int j = std::max(row - 1, 0); j <= std::min(row + 1, region_.height - 1); ++j) {
      for (int i = std::max(column - 1, 0); i <= std::min(column + 1, region_.width - 1); ++i) {
        const int index = j * region_.width + i;
        const double height = heights_[static_cast<std::size_t>(index)];
        if (height < low) low = height;
        if (height > high) high = height;
      }
    }
    return low <= kReachSigmas && high >= -kReachSigmas;
  }

  void paint_pixel(int column, int row) {
    Cells cells;
    if (!fill_cells(column + region_.x, row + region_.y, cells)) return;
    const int reach = spread_.reach();
    for (int across = 0; across < kCells; ++across) {
      for (int j = -reach; j <= reach; ++j) {
        double light = 0.0;
        for (int down = 0; down < kCells; ++down) {
          light += cells[static_cast<std::size_t>(down)][static_cast<std::size_t>(across)] *
                   spread_.share(down, j);
        }
        if (light != 0.0) spread_across(column, row + j, across, light);
      }
    }
  }

  /// Light that leaves the image comes back mirrored, as if the scene went on symmetrically.
  void spread_across(int column, int row, int cell, double light) {
    auto* const pixels = electrons_.ptr<double>(mirrored(row, region_.height));
    const int reach = spread_.reach();
    for (int i = -reach; i <= reach; ++i) {
      pixels[mirrored(column + i, region_.width)] += light * spread_.share(cell, i);
    }
  }

  static int mirrored(int index, int size) noexcept {
    const int inside = index < 0 ? -1 - index : index >= size ? 2 * size - 1 - index : index;
    return std::clamp(inside, 0, size - 1);
  }

  /// The electrons of every cell of a pixel; false where none has any.
  bool fill_cells(int u, int v, Cells& cells) {
    const RayGrid& rays = view_.rays();
    const Eigen::Vector2d du = 0.5 * (rays.at(u + 1, v) - rays.at(u - 1, v));
    const Eigen::Vector2d dv = 0.5 * (rays.at(u, v + 1) - rays.at(u, v - 1));
    const CellRays cell_rays = interpolate_cells(u, v);
    bool any = false;
    for (std::size_t down = 0; down < kCells; ++down) {
      for (std::size_t across = 0; across < kCells; ++across) {
        const Eigen::Vector2d& ray = cell_rays[down][across];
        const double light = ray.allFinite() ? cell_light(u, v, ray.homogeneous(), du, dv) : 0.0;
        cells[down][across] = light;
        any = any || light != 0.0;
      }
    }
    return any;
  }

  using CellRays = std::array<std::array<Eigen::Vector2d, kCells>, kCells>;  // [down][across]

  /// The rays through the middles of a pixel's cells: RayGrid::interpolate for all of them at once.
  CellRays interpolate_cells(int u, int v) const noexcept {
    std::array<std::array<Eigen::Vector2d, kCells>, kTaps> rows;  // Across, then down.
    for (int tap = 0; tap < kTaps; ++tap) {
      for (std::size_t cell = 0; cell < kCells; ++cell) {
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        for (int i = 0; i < kTaps; ++i) {
          sum += weights_[cell][static_cast<std::size_t>(i)] *
                 view_.rays().at(u + i - kTaps / 2, v + tap - kTaps / 2);
        }
        rows[static_cast<std::size_t>(tap)][cell] = sum;
      }
    }
    CellRays result;
    for (std::size_t down = 0; down < kCells; ++down) {
      for (std::size_t across = 0; across < kCells; ++across) {
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        for (std::size_t tap = 0; tap < kTaps; ++tap)
          sum += weights_[down][tap] * rows[tap][across];
        result[down][across] = sum;
      }
    }
    return result;
  }

  using Taps = std::array<std::array<double, kTaps>, kCells>;

  /// The cubic weights of the pixels around a cell's own, for each cell of an axis.
  static Taps tap_weights() noexcept {
    Taps taps{};
    for (int cell = 0; cell < kCells; ++cell) {
      const double position = CellSpread::cell_center(cell);
      const int base = position < 0.0 ? -1 : 0;
      const Eigen::Vector4d weights = cubic_weights(position - base);
      for (int i = 0; i < 4; ++i) {
        const int tap = base - 1 + i + kTaps / 2;
        taps[static_cast<std::size_t>(cell)][static_cast<std::size_t>(tap)] = weights[i];
      }
    }
    return taps;
  }

  /// Electrons of one cell. @param du, dv the ray's change per pixel.
  double cell_light(int u, int v, const Eigen::Vector3d& ray, const Eigen::Vector2d& du,
                    const Eigen::Vector2d& dv) {
    const World& world = view_.world();
    const Hit hit = view_.cast(u, v, ray);
    if (!hit.found()) return 0.0;
    const Eigen::Vector3d point = hit.t * ray;
    const Eigen::Vector3d normal = world.normal_to_camera(hit.facet, point);
    const BeamAt light = beam_.at(point, normal);
    if (light.peak_fluence_j_m2 == 0.0) return 0.0;

    // d(t r) / dq = t (dr - r (m . dr) / (m . r)) on a surface with the normal m.
    const Eigen::Vector3d along_ray = ray / normal.dot(ray);
    const auto slope = [&](const Eigen::Vector2d& change) {
      const Eigen::Vector3d step(change.x(), change.y(), 0.0);
      return hit.t * beam_.normal().dot(step - normal.dot(step) * along_ray);
    };
    const double scale = kCell / light.sigma_m;
    const double ridge =
        mean_ridge(beam_.height_m(point) / light.sigma_m, scale * slope(du), scale * slope(dv));
    if (ridge == 0.0 || world.blocked(beam_.origin(), point, casters(u, v, hit))) return 0.0;
    const Reflection spot = view_.shading().reflection(hit, point);
    return kCell * kCell * ridge * light.peak_fluence_j_m2 *
           view_.shading().electrons_per_fluence(spot, point, beam_.origin(), laser_);
  }

  /// What may stand between the laser and what is seen around a hit.
  const std::vector<int>& casters(int u, int v, const Hit& hit) {
    const Sight& sight = view_.tiles().of(u, v, hit.facet);
    auto& casters = casters_[static_cast<std::size_t>(sight.number)];
    if (!casters) {
      casters.emplace();
      for (const int caster : near_plane_) {
        if (view_.world().may_block(caster, beam_.origin(), sight)) casters->push_back(caster);
      }
    }
    return *casters;
  }

  const View& view_;
  const Beam& beam_;
  int laser_;
  cv::Rect region_;
  CellSpread spread_;
  Taps weights_ = tap_weights();
  std::vector<int> near_plane_;
  std::vector<std::optional<std::vector<int>>> casters_;  // Of each sight, once asked for.
  std::vector<double> heights_;
  cv::Mat electrons_;
};

}  // namespace

cv::Mat View::laser(const Beam& beam, int index) const {
  return StripePainter(*this, beam, index).paint();
}

}  // namespace striper::detail
