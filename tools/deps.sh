#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Sourced by test.sh and demo.sh: installs Debian packages by name, only those that are missing. Run by itself it installs
# what the whole build needs.

packages_to_demo=(
  g++ cmake ninja-build ccache pkg-config
  libopencv-dev libeigen3-dev libhwy-dev libyaml-cpp-dev libfmt-dev libcli11-dev nlohmann-json3-dev
  libjpeg-dev libpng-dev libtiff-dev zlib1g-dev
  libboost-dev # the sink web:
  gnuplot-nox
)
packages_to_build=(
  "${packages_to_demo[@]}"
  libceres-dev libzstd-dev liblz4-dev
  libaravis-dev libusb-1.0-0-dev
  cyclonedds-dev cyclonedds-tools # the sink ros2:
  libncurses-dev                  # the screen of guide console
)
packages_to_test=(
  pybind11-dev python3-dev python3-numpy python3-pytest python3-matplotlib mypy # the Python package
  libgtest-dev libgmock-dev libbenchmark-dev git python3 gnuplot-nox tmux
  systemd python3-prometheus-client                        # what checks the service's unit and its metrics
  qemu-system-x86 busybox-static kmod v4l-utils # the virtual machine of tests/v4l2_vm
  can-utils                                     # candump, in that machine
  aravis-tools aravis-tools-cli iproute2        # other GenICam programs for tests/end_to_end/gige_test.py
)
packages_to_test_fully=(clang clang-format clang-tidy pcl-tools libfastrtps-dev fastddsgen chromium chromium-driver python3-selenium)

# install_packages NAME...: through sudo where we are not root; says what it does.
install_packages() {
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || {
      echo "these packages are missing and there is no sudo to install them: ${missing[*]}" >&2
      return 1
    }
    as_root=(sudo)
  fi
  echo "installing ${missing[*]}" >&2
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq >&2
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2
}

if [ "${BASH_SOURCE[0]}" = "$0" ]; then install_packages "${packages_to_build[@]}"; fi
