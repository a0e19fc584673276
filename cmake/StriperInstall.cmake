# SPDX-License-Identifier: Apache-2.0
# Installs the libraries, headers and the package that `find_package(striper COMPONENTS ...)` reads. Each library is an
# install component of its own: `cmake --install build --component sdk`.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(STRIPER_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/striper)
get_property(installed GLOBAL PROPERTY STRIPER_INSTALLED)

foreach(target IN LISTS installed)
  string(REPLACE "striper_" "" component ${target})
  install(TARGETS ${target} EXPORT striper-${component}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${component}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${component}
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT ${component})
  install(EXPORT striper-${component} NAMESPACE striper:: DESTINATION ${STRIPER_CMAKE_DIR}
    COMPONENT ${component})

  # What find_package() has to look for first: a static library needs its private dependencies too.
  get_property(dependencies GLOBAL PROPERTY STRIPER_DEPENDENCIES_${component})
  list(JOIN dependencies "\n" dependencies)
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/striper-${component}-dependencies.cmake "${dependencies}\n")
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/striper-${component}-dependencies.cmake
    DESTINATION ${STRIPER_CMAKE_DIR} COMPONENT ${component})
endforeach()

configure_package_config_file(cmake/striper-config.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/striper-config.cmake INSTALL_DESTINATION ${STRIPER_CMAKE_DIR})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/striper-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${CMAKE_CURRENT_BINARY_DIR}/striper-config.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/striper-config-version.cmake
  DESTINATION ${STRIPER_CMAKE_DIR} COMPONENT sdk)
