// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <striper/design/design_figures.hpp>

namespace striper::program {

/// The figures as a table for people, with what was put in told apart from what comes out.
std::string design_text(const DesignFigures& figures, const std::vector<double>& ranges_m);

/// The same for programs; what does not exist or is infinite is null.
nlohmann::json design_json(const DesignFigures& figures, const std::vector<double>& ranges_m);

/// Errors and ratios over range, as SVG.
std::string design_svg(const DesignFigures& figures);

/// What the paper (Mertz et al. 2002) prints beside what comes out here.
std::string paper_text();

}  // namespace striper::program
