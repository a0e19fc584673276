// SPDX-License-Identifier: Apache-2.0
#include <striper/core/error.hpp>

#include "bindings.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

const char* word_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kUsage:
      return "usage";
    case ErrorKind::kNotFound:
      return "not_found";
    case ErrorKind::kBadFile:
      return "bad_file";
    case ErrorKind::kBadValue:
      return "bad_value";
    case ErrorKind::kUnsupported:
      return "unsupported";
    case ErrorKind::kDevice:
      return "device";
    case ErrorKind::kIo:
      return "io";
    case ErrorKind::kUntrustworthy:
      return "untrustworthy";
  }
  return "";
}

PyObject* error_class = nullptr;  // Lives as long as the interpreter.

// NOLINTNEXTLINE(performance-unnecessary-value-param): as pybind11 calls it.
void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const Error& error) {
    const py::object value = py::handle(error_class)(error.what());
    value.attr("kind") = word_of(error.kind());
    PyErr_SetObject(error_class, value.ptr());
  }
}

}  // namespace

void bind_errors(py::module_& module) {
  error_class = PyErr_NewExceptionWithDoc(
      "striper.Error",
      "A failure of set-up or of input: one sentence that names the file or field, the value and "
      "what was expected.\n\n`kind` is usage, not_found, bad_file, bad_value, unsupported, device, "
      "io or untrustworthy.",
      PyExc_RuntimeError, nullptr);
  module.add_object("Error", py::reinterpret_borrow<py::object>(error_class));
  py::register_exception_translator(translate);
}

}  // namespace striper::python
