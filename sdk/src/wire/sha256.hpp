// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace striper::detail {

/// SHA-256 (NIST FIPS 180-4) as 64 hexadecimal digits. For names of types, not for secrets.
std::string sha256_hex(std::string_view bytes);

}  // namespace striper::detail
