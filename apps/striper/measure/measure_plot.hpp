// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <striper/profile/segments.hpp>
#include <striper/profile/tools.hpp>

namespace striper::program {

/// What `measure --plot` shows: a scan from above, its pieces and corners with their error bars,
/// and how what was measured goes on from scan to scan.
class MeasurePlot {
 public:
  /// Keeps the first scan and the first thousand measurements of each row. @param model may be
  /// null.
  void add(const PolarScan& scan, const StriperModel* model);
  void add(const Measurement& measurement, std::uint64_t frame);

  /// As SVG. Precondition: a scan was added.
  std::string svg() const;

 private:
  struct Value {
    double frame, value, sigma;
  };
  struct Series {
    std::string unit;
    std::vector<Value> values;
  };

  bool has_scan_ = false;
  PolarScan scan_;
  Segmentation pieces_;
  std::map<std::string, Series> series_;
};

}  // namespace striper::program
