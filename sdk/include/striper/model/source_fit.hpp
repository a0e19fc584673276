// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <striper/core/frame_source.hpp>
#include <striper/model/striper_model.hpp>

namespace striper {

/// Why a model cannot be of a source: "is of a camera of 640x480 pixels, but source 'gige:X' has
/// 2048x1088"; empty where it can. All of such a source's frames would be refused. Thread-safe.
std::string why_not_of_source(const StriperModel& model, const SourceInfo& source);

}  // namespace striper
