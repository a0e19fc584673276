// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <string>
#include <utility>

#include <striper/pipeline/scanner_option.hpp>

namespace py = pybind11;

namespace striper::python {
namespace {

// A boolean is no number here; repr of a float reads back to the same.
std::string text_of(const py::handle& value) {
  return py::isinstance<py::str>(value) ? value.cast<std::string>()
                                        : py::repr(value).cast<std::string>();
}

}  // namespace

ScannerOptions scanner_options_of(const StriperModel* model, const py::dict& given) {
  ScannerOptions options;
  for (const auto& [name, value] : given) {
    if (!value.is_none()) set_scanner_option(options, name.cast<std::string>(), text_of(value));
  }
  return model != nullptr ? ScannerOptions::for_model(*model, std::move(options)) : options;
}

py::list scanner_option_table() {
  py::list table;
  for (const ScannerOption& option : scanner_options()) {
    py::dict row;
    row["name"] = std::string(option.name);
    row["help"] = std::string(option.help);
    row["unit"] = std::string(option.unit);
    py::list words;
    for (const std::string_view word : option.words) words.append(std::string(word));
    row["words"] = words;
    row["form"] = std::string(option.form);
    row["low"] = option.low;
    row["high"] = option.high;
    row["default"] = option.what_if_not_given.empty() ? option.get(ScannerOptions{})
                                                      : std::string(option.what_if_not_given);
    table.append(row);
  }
  return table;
}

}  // namespace striper::python
