# SPDX-License-Identifier: Apache-2.0
# The helpers that every CMakeLists.txt of the project uses: one way to make a library, one to make a test.

# Puts the project's warnings, sanitizers and language level on one target.
function(striper_target_defaults target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wno-psabi)
  if(STRIPER_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")  # Collects its garbage later: an eighth of its time for a fifth more memory.
    target_compile_options(${target} PRIVATE "SHELL:--param ggc-min-expand=1000" "SHELL:--param ggc-min-heapsize=1000000")
  endif()
  if(STRIPER_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${STRIPER_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${STRIPER_SANITIZE})
    if(STRIPER_SANITIZE MATCHES "undefined")
      target_compile_options(${target} PRIVATE -fno-sanitize-recover=undefined)
    endif()
  endif()
endfunction()

# striper_precompile(target <more> ...): has a target read once what nearly all of its sources include. No source may
# rely on it; preset `tidy` builds without.
function(striper_precompile target)
  if(STRIPER_PCH)
    target_precompile_headers(${target} PRIVATE
      <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <functional> <limits> <map> <memory> <optional>
      <span> <string> <string_view> <utility> <vector>
      <fmt/format.h> <fmt/ranges.h> <Eigen/Core> <Eigen/Geometry> <opencv2/core/mat.hpp> ${ARGN})
  endif()
endfunction()

# striper_library(sdk HEADERS ... SOURCES ...): the library striper::sdk; the headers are its public
# file set, named relative to <module>/include.
function(striper_library name)
  cmake_parse_arguments(ARG "" "" "HEADERS;SOURCES" ${ARGN})
  set(target striper_${name})
  add_library(${target} ${ARG_SOURCES})
  add_library(striper::${name} ALIAS ${target})
  striper_target_defaults(${target})
  striper_precompile(${target})
  list(TRANSFORM ARG_HEADERS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/include/)
  target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${ARG_HEADERS})
  target_include_directories(${target} PRIVATE src)
  set_target_properties(${target} PROPERTIES
    EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON VERIFY_INTERFACE_HEADER_SETS ${STRIPER_TESTS})
  set_property(GLOBAL APPEND PROPERTY STRIPER_INSTALLED ${target})
  set_property(GLOBAL APPEND PROPERTY STRIPER_HEADERS ${ARG_HEADERS})
endfunction()

# striper_sources(sdk HEADERS ... SOURCES ...): adds to a library what is built only where something is
# installed.
function(striper_sources name)
  cmake_parse_arguments(ARG "" "" "HEADERS;SOURCES" ${ARGN})
  list(TRANSFORM ARG_HEADERS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/include/)
  target_sources(striper_${name} PRIVATE ${ARG_SOURCES})
  target_sources(striper_${name} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${ARG_HEADERS})
  set_property(GLOBAL APPEND PROPERTY STRIPER_HEADERS ${ARG_HEADERS})
endfunction()

# striper_depends(sdk "find_dependency(fmt)" ...): what a user of the installed library must find, in
# this order; the arguments are lines of CMake.
function(striper_depends name)
  set_property(GLOBAL APPEND PROPERTY STRIPER_DEPENDENCIES_${name} ${ARGN})
endfunction()

# What tests do themselves is little: compiled for speed they take a third longer to compile. GCC takes the level of
# the precompiled header for all that includes it, so its owner and its users have to have the same. At -O1 it sees
# uninitialised members of variants that hold something else.
function(striper_test_options target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-Wno-maybe-uninitialized>)
  endif()
endfunction()

# striper_test(name LABELS quick SOURCES ... LIBRARIES ...): one GoogleTest program, a ctest test per TEST.
# Labels: quick (default), slow (run by ./test.sh --full), device (the virtual machine, and
# streams at full rate: wants the machine to itself).
function(striper_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "LABELS;SOURCES;LIBRARIES" ${ARGN})
  if(NOT ARG_LABELS)
    set(ARG_LABELS quick)
  endif()
  if(ARG_TIMEOUT)
    set(ARG_TIMEOUT TIMEOUT ${ARG_TIMEOUT})
  endif()
  # Tests of one name share their labels: a quick test with the name of a slow one would be run as neither.
  set(prefix "")
  if("slow" IN_LIST ARG_LABELS)
    set(prefix "full.")
  endif()
  add_executable(${name} ${ARG_SOURCES})
  striper_target_defaults(${name})
  striper_test_options(${name})
  target_link_libraries(${name} PRIVATE striper_test_support ${ARG_LIBRARIES})
  if(STRIPER_PCH)
    target_precompile_headers(${name} REUSE_FROM striper_test_support)
  endif()
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
    TEST_PREFIX "${prefix}" PROPERTIES LABELS "${ARG_LABELS}" ${ARG_TIMEOUT})
endfunction()
