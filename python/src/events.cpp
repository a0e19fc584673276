// SPDX-License-Identifier: Apache-2.0
#include "events.hpp"

#include <memory>
#include <string>

#include <fmt/format.h>

#include "bindings.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

// A Python object that any thread may let go of.
std::shared_ptr<py::object> shared(py::object object) {
  const auto release = [](py::object* held) {
    if (Py_IsInitialized() == 0) return;  // The interpreter took it along.
    const py::gil_scoped_acquire lock;
    delete held;
  };
  return {new py::object(std::move(object)), release};
}

std::string text_of(const Event& event) {
  return fmt::format("<striper.Event {} {}: {}>", to_string(event.severity), event.code.word(),
                     event.message);
}

}  // namespace

EventPort port_of(const py::object& on_event) {
  const py::object callback =
      on_event.is_none() ? py::module_::import("striper").attr("_log_event") : on_event;
  return EventPort([handler = shared(callback)](const Event& event) {
    if (Py_IsInitialized() == 0) return;
    const py::gil_scoped_acquire lock;
    try {
      (*handler)(event);
    } catch (py::error_already_set& raised) {
      raised.discard_as_unraisable("striper's on_event");
    }
  });
}

void bind_events(py::module_& module) {
  py::class_<Event>(module, "Event", "Something that happened, or was found.")
      .def_property_readonly(
          "severity", [](const Event& e) { return std::string(to_string(e.severity)); },
          "info, warning, error or refusal.")
      .def_property_readonly(
          "code", [](const Event& e) { return std::string(e.code.word()); },
          "A word that stands for its kind and does not change.")
      .def_readonly("message", &Event::message, "For people: what it is.")
      .def_readonly("advice", &Event::advice, "For people: what to do about it; may be empty.")
      .def_readonly("head", &Event::head, "Whose it is; empty where there are no heads.")
      .def_readonly("time", &Event::time_s, "Seconds since 1970.")
      .def("__repr__", text_of);
}

}  // namespace striper::python
