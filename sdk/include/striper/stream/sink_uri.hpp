// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <striper/core/uri.hpp>

namespace striper {

/// A sink's address taken apart: `csv:scans.csv?missing=yes`. A bare path gets its scheme from its
/// extension; `-`, what is under /dev and a path without extension are `csv`.
class SinkUri : public Uri {
 public:
  /// @throws Error{kUsage} on an empty address, an unknown scheme or extension, or a key that is
  /// given twice.
  static SinkUri parse(std::string_view text);

 private:
  using Uri::Uri;
};

}  // namespace striper
