// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <striper/model/striper_model.hpp>

#include "core/yaml_field.hpp"
#include "model/model_checks.hpp"

namespace striper::detail {

/// Reads the `stripe:` block of a model file into the model: axis, channels, and the looks of its
/// lasers, which must have been read.
/// @throws Error{kBadFile} naming the field.
void read_stripe(const YamlField& field, StriperModel& model);

/// The block as the file has it, without a comment above; looks only as far as there are any.
std::string stripe_text(const StriperModel& model);

/// Finds the first thing in the look of a laser's stripe that cannot be.
std::optional<Violation> check_look(const StripeLook& look, std::size_t laser);

}  // namespace striper::detail
