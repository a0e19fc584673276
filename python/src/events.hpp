// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <striper/core/event.hpp>

namespace striper::python {

/// A port that calls `on_event(Event)`; None: the log of the module `logging`, as "striper". What a
/// callback raises is reported as unraisable and stops nothing. Called from any thread of the
/// library: whoever calls into it must not hold the interpreter's lock.
EventPort port_of(const pybind11::object& on_event);

}  // namespace striper::python
