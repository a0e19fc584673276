// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <striper/core/uri.hpp>

namespace striper {

/// A source's address taken apart. A bare path gets its scheme from what it is: a `.yaml` file is
/// `sim`, a `.mcap` file `mcap`, `/dev/video*` is `v4l2`, the rest `images`.
class SourceUri : public Uri {
 public:
  /// @throws Error{kUsage} on an empty address, an unknown scheme or a key that is given twice.
  static SourceUri parse(std::string_view text);

 private:
  using Uri::Uri;
};

}  // namespace striper
