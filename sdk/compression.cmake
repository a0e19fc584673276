# SPDX-License-Identifier: Apache-2.0
# What MCAP chunks may be compressed with, where it is installed.
find_package(PkgConfig)

# striper_compression(ZSTD libzstd): links the library and tells src/wire/mcap_compression.cpp of it.
function(striper_compression name module)
  if(NOT STRIPER_WITH_${name})
    return()
  endif()
  if(PKG_CONFIG_FOUND)
    pkg_check_modules(${name} IMPORTED_TARGET GLOBAL ${module})
  endif()
  if(NOT ${name}_FOUND)
    message(STATUS "No ${module} (${module}-dev): MCAP files cannot be compressed with it")
    return()
  endif()
  target_link_libraries(striper_sdk PRIVATE PkgConfig::${name})
  set_property(SOURCE src/wire/mcap_compression.cpp APPEND PROPERTY COMPILE_DEFINITIONS STRIPER_WITH_${name})
  striper_depends(sdk
    "find_dependency(PkgConfig)"
    "pkg_check_modules(${name} REQUIRED IMPORTED_TARGET ${module})")
endfunction()

striper_compression(ZSTD libzstd)
striper_compression(LZ4 liblz4)
