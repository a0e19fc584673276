// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include <striper/detect/curb_finder.hpp>

#include "detect/curb/curb_lines.hpp"
#include "detect/curb/curb_posterior.hpp"
#include "detect/curb/ground_roughness.hpp"
#include "detect/curb/sparse_face.hpp"
#include "profile/cutter.hpp"

namespace striper::detail {

/// Two parked vehicles and the curb.
inline constexpr std::size_t kMostFindingsOfASide = 3;

/// A scan as its pieces, and what is asked of them.
struct CutScan {
  const Cutter& cutter;
  const Segmentation& pieces;
  const CurbOptions& options;
};

/// How the road ends on one side.
struct RoadEnd {
  double lateral_m = 0.0;  ///< As far as ground is seen before anything leaves it.
  /// Outwards: what stands on the road, and then what ends it. Valid until the next look.
  std::span<const CurbFinding> findings;
};

/// Goes outwards from the road, piece by piece, to the first surface that leaves it; where the road
/// is seen again behind that, on from there.
class RoadSide {
 public:
  /// @param road the piece to begin with. @param along where lateral grows.
  /// @param out +1 or -1: the side, along `along`.
  RoadEnd look(const CutScan& scan, std::size_t road, const Eigen::Vector2d& along, double out);

 private:
  using Index = std::ptrdiff_t;
  static constexpr Index kNowhere = -1;
  static constexpr std::size_t kMostFindings = kMostFindingsOfASide;

  /// A piece seen from the ground's line: s outwards, z above it.
  struct Strip {
    Eigen::Vector2d near{0.0, 0.0};
    Eigen::Vector2d far{0.0, 0.0};
    double slope_rad = 0.0;
    bool is_level = false;
    bool is_rough = false;  // More than paving.
    int points = 0;

    double length_m() const { return far.x() - near.x(); }
    bool is_at(double z_m) const;  ///< Its nearer end, to what unevenness makes.
  };

  const Piece& piece(Index k) const;
  const Run& run(Index k) const;
  bool has(Index k) const;
  Strip strip(Index k) const;
  bool is_gutter(const Strip& s) const;
  bool is_bend(Index k) const;
  bool is_chip_of(Index k, Index behind) const;
  void take_ground(Index k);
  void begin_at(Index ground);
  std::optional<CurbFinding> next();
  void find_leaving();
  void find_top();
  void look_behind(Index from);
  std::optional<CurbFinding> rise();
  std::optional<CurbFinding> drop();
  std::optional<CurbFinding> verge() const;
  CurbLines first_lines() const;
  std::size_t with_speckle_at(std::size_t element) const;
  std::optional<ScanLine> sparse_face();
  double gain(Index k) const;
  double overgrown_beyond(const Eigen::Vector2d& edge_m);
  double returns_between(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) const;
  Index first_beyond(const Eigen::Vector2d& at_m) const;

  const CutScan* scan_ = nullptr;
  Eigen::Vector2d along_{1.0, 0.0};
  Eigen::Vector2d out_{1.0, 0.0};
  Index step_ = 1;
  Index first_ = 0;           // Of the road.
  Index ground_ = 0;          // The last straight piece of it.
  double reach_m_ = 0.0;      // Of the ground, outwards.
  Index leaving_ = kNowhere;  // The first piece off the ground,
  Strip leaves_;              // seen from it.
  Index face_ = kNowhere;
  Index top_ = kNowhere;
  Index behind_ = kNowhere;  // Ground that is seen again.
  CurbEvidence evidence_;
  SparseFace sparse_;
  CurbRefiner refiner_;
  GroundRoughness roughness_;
  std::array<CurbFinding, kMostFindings> findings_;
};

}  // namespace striper::detail
