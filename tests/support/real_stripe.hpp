// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <striper/core/channel.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/scan/polar_scan.hpp>
#include <striper/stripe/expected_stripe.hpp>

namespace striper::testing {

/// What is known of the stripe in a real image, by hand-checked paths.
struct RealImage {
  std::string file;  ///< Below the folder of all sets.
  StripeAxis axis = StripeAxis::kColumns;
  std::vector<std::vector<Eigen::Vector2d>> stripes;  ///< Knots (line, position).
  std::vector<std::pair<int, int>> empty;  ///< First and last scan line without a stripe.

  std::string set() const { return file.substr(0, file.find('/')); }
  std::optional<double> stripe_at(int line) const;  ///< Empty where there is none or not known.
  bool is_empty_at(int line) const;
  Frame frame(std::uint64_t sequence) const;  ///< As read. @throws Error{kBadFile}
};

/// Those with a laser: tests/support/real_stripe_paths.txt, which says what it means.
/// @throws Error{kBadFile} quoting a line that is not understood.
std::vector<RealImage> real_images();

/// Boards of a set that no laser was near: all scan lines are without a stripe.
std::vector<RealImage> real_boards(const std::string& set, const std::string& extension,
                                   StripeAxis axis);

/// Shares of a real image's scan lines, or of many's.
struct RealScore {
  /// The stripes are 6 to 13 pixels wide at half height, speckled, and their paths good to a pixel.
  static constexpr double kRightPx = 4.0;

  std::size_t lines = 0;
  std::size_t with_stripe = 0;  ///< Judged scan lines,
  std::size_t empty = 0;        ///< and those without a stripe.
  std::size_t ok = 0;
  std::size_t found = 0;
  std::size_t wrong = 0;     ///< `ok` elsewhere than the stripe, or where there is none.
  std::size_t unjudged = 0;  ///< `ok` in scan lines of which nothing is known.
  std::size_t images = 0;
  std::size_t unseen = 0;  ///< Images with `is_stripe_seen` false.

  void add(const PolarScan& scan, const RealImage& image);
  void add(const RealScore& other);

  std::size_t judged() const { return with_stripe + empty; }
};

/// What is expected of a stripe of that width and height anywhere in an image.
ExpectedStripe stripe_of_look(double sigma_px, float amplitude_dn);

struct RealSettings {
  Channel channel = Channel::kAuto;
  PeakRule peak = ExtractOptions{}.peak;
  bool is_each = false;  ///< A new scanner for each image.
  /// What a model would say of the stripe: its width and height. Empty: nothing.
  std::vector<ExpectedStripe> expected = {};

  ScannerOptions options(StripeAxis axis) const;
};

/// A scanner without a model for the images of a folder, one after the other, as
/// `capture images:` has it.
class RealScanner {
 public:
  explicit RealScanner(const RealSettings& settings) : settings_(settings) {}

  /// @throws Error{kBadFile} where an image gives no scan.
  RealScore score(const RealImage& image);

 private:
  RealSettings settings_;
  std::filesystem::path folder_;
  StripeAxis axis_ = StripeAxis::kColumns;
  std::uint64_t sequence_ = 0;
  std::unique_ptr<Scanner> scanner_;
};

}  // namespace striper::testing
