// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <striper/core/frame_source.hpp>
#include <striper/model/striper_model.hpp>
#include <striper/pipeline/scanner.hpp>

namespace striper::python {

/// Options by their names on the command line, hyphens as underscores: those of the model (which
/// may be null), then what is given. @throws Error{kUsage} naming an option that is unknown or
/// cannot be.
ScannerOptions scanner_options_of(const StriperModel* model, const pybind11::dict& given);

/// The table of options, as dictionaries.
pybind11::list scanner_option_table();

}  // namespace striper::python
