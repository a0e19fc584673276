// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <pybind11/pybind11.h>

#include <striper/core/event.hpp>
#include <striper/model/striper_model.hpp>

namespace striper::python {

/// A model that is given as a Model, as a file's path, or not at all (None: null).
std::shared_ptr<const StriperModel> model_of(const pybind11::object& given,
                                             const EventPort& events = {});

}  // namespace striper::python
