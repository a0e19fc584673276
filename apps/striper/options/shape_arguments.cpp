// SPDX-License-Identifier: Apache-2.0
#include "options/shape_arguments.hpp"

#include <fmt/format.h>

#include "options/option_bounds.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"

namespace striper::program {

ShapeOptions ShapeArguments::options() const {
  ShapeOptions options;
  options.average = average;
  options.smooth = smooth == "line";
  if (resample) options.resample = parse_resample_grid(*resample);
  options.fill_gaps_m = fill_gaps_m;
  options.validate();
  return options;
}

void add_shape_arguments(Command& command, ShapeArguments& arguments) {
  command
      .add_option("--average", arguments.average,
                  "Make one scan of N, of a sensor that stands still; what moves is refused "
                  "(status outlier)")
      ->type_name("N")
      ->check(between(1, 10000));
  command
      .add_option("--smooth", arguments.smooth,
                  "line: estimate every range again from its surface, never across an edge; what "
                  "lies off every surface becomes an outlier; default off")
      ->type_name("off|line")
      ->check(one_of({"off", "line"}));
  command
      .add_option("--resample", arguments.resample,
                  "Returns at whole multiples of a step: x=M or y=M (metres), bearing=DEG")
      ->type_name("AXIS=STEP");
  command
      .add_option("--fill-gaps", arguments.fill_gaps_m,
                  "With --resample: fill gaps up to so many metres (status filled; tables have "
                  "them with --doubtful)")
      ->type_name("M")
      ->check(above_zero());
}

}  // namespace striper::program
