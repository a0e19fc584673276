// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <striper/design/solar_spectrum.hpp>

#include "design/bounds.hpp"
#include "design/solar_table.hpp"

namespace striper {
namespace {

constexpr double kSiliconFrom_nm = 300.0;  // Glass takes what is shorter.
constexpr double kSiliconTo_nm = 1100.0;   // Where photons begin to pass silicon.

struct Node {
  double nm;
  double w_m2_nm;
};

const std::vector<Node>& nodes() {
  static const std::vector<Node> table = [] {
    std::vector<Node> rows;
    std::istringstream text(detail::kSolarTable);
    std::string header;
    std::getline(text, header);
    Node node{};
    char comma = 0;
    while (text >> node.nm >> comma >> node.w_m2_nm) rows.push_back(node);
    return rows;
  }();
  return table;
}

// The integral of irradiance * wavelength^power from one wavelength to another, power 0 or 1: exact
// for a straight line with Simpson's rule on each piece.
double integral(double from_nm, double to_nm, bool weigh_with_wavelength) {
  const auto value = [&](double nm) {
    return solar_irradiance_w_m2_nm(nm) * (weigh_with_wavelength ? nm : 1.0);
  };
  double sum = 0.0;
  const std::vector<Node>& table = nodes();
  for (std::size_t i = 0; i + 1 < table.size(); ++i) {
    const double low = std::max(from_nm, table[i].nm);
    const double high = std::min(to_nm, table[i + 1].nm);
    if (low >= high) continue;
    sum += (high - low) / 6.0 * (value(low) + 4.0 * value(0.5 * (low + high)) + value(high));
  }
  return sum;
}

}  // namespace

double solar_irradiance_w_m2_nm(double wavelength_nm) {
  const std::vector<Node>& table = nodes();
  const auto after = std::lower_bound(table.begin(), table.end(), wavelength_nm,
                                      [](const Node& node, double nm) { return node.nm < nm; });
  if (after == table.end()) return 0.0;
  if (after->nm == wavelength_nm) return after->w_m2_nm;
  if (after == table.begin()) return 0.0;
  const Node& before = *(after - 1);
  const double part = (wavelength_nm - before.nm) / (after->nm - before.nm);
  return before.w_m2_nm + part * (after->w_m2_nm - before.w_m2_nm);
}

double solar_irradiance_w_m2(double from_nm, double to_nm) {
  return integral(from_nm, to_nm, false);
}

double solar_suppression(double centre_nm, double width_nm) {
  const double half_nm = 0.5 * width_nm;
  detail::require_between("width_nm", width_nm, 0.1, kSiliconTo_nm - kSiliconFrom_nm);
  detail::require_between("centre_nm", centre_nm, kSiliconFrom_nm + half_nm,
                          kSiliconTo_nm - half_nm);
  return integral(kSiliconFrom_nm, kSiliconTo_nm, true) /
         integral(centre_nm - half_nm, centre_nm + half_nm, true);
}

}  // namespace striper
