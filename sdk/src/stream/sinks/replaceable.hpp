// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace striper::detail {

/// Throws where a file is there, is not empty and begins with none of these: the model, or an
/// image file, is not for a sink to overwrite. @throws Error{kUsage} naming it.
void require_replaceable(const std::string& path,
                         std::initializer_list<std::string_view> beginnings);

}  // namespace striper::detail
