// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace striper::detail {

/// A file of the page, in the library itself: connect/web/page/, by page.cmake.
struct PageFile {
  std::string_view path;  ///< "/live.js"; of pages "/", "/health".
  std::string_view type;
  std::string_view content;
};

/// Exactly these are served, whatever a request's path says. Null for none.
const PageFile* find_page_file(std::string_view path) noexcept;

}  // namespace striper::detail
