# SPDX-License-Identifier: Apache-2.0
# Writes page.cpp with the pages' files in it: cmake -DFOLDER= -DOUT= -P page.cmake
# A page's file is what stands inside frame.html, in place of @content@; its first line, a comment, is the page's title.
cmake_minimum_required(VERSION 3.20)
file(GLOB files RELATIVE ${FOLDER} ${FOLDER}/*)
list(SORT files)
list(REMOVE_ITEM files frame.html)
file(READ ${FOLDER}/frame.html frame)
set(entries "")
foreach(name IN LISTS files)
  file(READ ${FOLDER}/${name} content)
  set(path "/${name}")
  if(content MATCHES "\\)page\"" OR content MATCHES ";;;;")
    message(FATAL_ERROR "${name}: cannot be put into a raw string")
  endif()
  if(name MATCHES "\\.html$")
    set(type "text/html; charset=utf-8")
    string(REGEX REPLACE "[.]html$" "" page ${name})
    string(REGEX MATCH "^<!-- ([^\n]*) -->" first "${content}")
    set(title "${CMAKE_MATCH_1}")
    string(REPLACE "@content@" "${content}" content "${frame}")
    string(REPLACE "@page@" "${page}" content "${content}")
    string(REPLACE "@title@" "${title}" content "${content}")
    string(REPLACE "/live" "/" path "/${page}")
  elseif(name MATCHES "\\.js$")
    set(type "text/javascript; charset=utf-8")
  elseif(name MATCHES "\\.css$")
    set(type "text/css; charset=utf-8")
  elseif(name MATCHES "\\.svg$")
    set(type "image/svg+xml")
  else()
    message(FATAL_ERROR "${name}: of which type is it?")
  endif()
  string(APPEND entries "    {\"${path}\", \"${type}\", R\"page(${content})page\"},\n")
endforeach()
file(WRITE ${OUT} "// Made by connect/web/page.cmake.
#include \"page.hpp\"

#include <algorithm>
#include <array>
#include <iterator>

namespace striper::detail {
namespace {

constexpr PageFile kFiles[] = {
${entries}};

}  // namespace

const PageFile* find_page_file(std::string_view path) noexcept {
  const auto is_it = [&](const PageFile& file) { return file.path == path; };
  const auto* const found = std::find_if(std::begin(kFiles), std::end(kFiles), is_it);
  return found == std::end(kFiles) ? nullptr : found;
}

}  // namespace striper::detail
")
