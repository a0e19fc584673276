# SPDX-License-Identifier: Apache-2.0
# GigE Vision and USB3 Vision cameras, through Aravis, where it is installed.
if(STRIPER_WITH_ARAVIS)
  find_package(PkgConfig)
  if(PKG_CONFIG_FOUND)
    pkg_check_modules(ARAVIS IMPORTED_TARGET GLOBAL aravis-0.8)
  endif()
  if(NOT ARAVIS_FOUND)
    message(STATUS "No Aravis (libaravis-dev and libusb-1.0-0-dev): gige: and u3v: are left out")
  endif()
endif()
if(NOT ARAVIS_FOUND)
  set(ARAVIS_FOUND 0)
endif()
if(ARAVIS_FOUND)
  striper_sources(capture
    HEADERS
      striper/gige/gige_network.hpp
      striper/gige/gige_options.hpp
      striper/gige/gige_source.hpp
    SOURCES
      src/gige/clock/camera_clock.cpp
      src/gige/control/camera_setup.cpp
      src/gige/protocol/feature_access.cpp
      src/gige/protocol/find_camera.cpp
      src/gige/pictures/frame_pool.cpp
      src/gige/protocol/gige_network.cpp
      src/gige/gige_options.cpp
      src/gige/gige_source.cpp
      src/gige/protocol/gvcp_client.cpp
      src/gige/control/laser_lines.cpp
      src/gige/pictures/pixel_layout.cpp
      src/gige/clock/ptp_clock.cpp
      src/gige/protocol/reverse_path.cpp
      src/gige/session.cpp
      src/gige/source_controls.cpp
      src/gige/protocol/stream_path.cpp
      src/gige/protocol/stream_socket.cpp
      src/gige/protocol/udp_socket.cpp)
  target_link_libraries(striper_capture PRIVATE PkgConfig::ARAVIS)
  striper_depends(capture
    "find_dependency(PkgConfig)"
    "pkg_check_modules(ARAVIS REQUIRED IMPORTED_TARGET aravis-0.8)")
  target_compile_definitions(striper_capture PRIVATE STRIPER_HAS_ARAVIS)
endif()
set(ARAVIS_FOUND ${ARAVIS_FOUND} PARENT_SCOPE)
