// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <striper/core/event.hpp>
#include <striper/model/striper_model.hpp>

namespace striper {

/// Reads a model file (`striper.yaml`; the format is in CONVENTIONS.md).
///
/// An unknown key is a warning in the log, as is a camera whose distortion folds inside its own
/// image. A plane with distance_m below 0 is turned round, its covariances with it.
/// @throws Error{kNotFound} where there is no such file, Error{kBadFile} quoting the file, the
/// field, the
///         value and what was expected for everything else.
StriperModel load_model(const std::filesystem::path& path, const EventPort& events = {});

/// The same from text; `name` stands for the file in messages.
StriperModel parse_model(const std::string& yaml, const std::string& name,
                         const EventPort& events = {});

/// Writes a model file; what `load_model` reads back is equal, bit for bit. The file appears whole
/// or not at all (written beside and renamed).
/// @throws Error{kBadValue} where the model is not valid, Error{kIo} where it cannot be written.
void save_model(const StriperModel& model, const std::filesystem::path& path);

/// The text that `save_model` writes.
std::string format_model(const StriperModel& model);

}  // namespace striper
