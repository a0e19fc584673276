#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds the release and runs the tests.
set -euo pipefail
cd "$(dirname "$0")"
. tools/deps.sh

usage() {
  cat <<'TXT'
usage: ./test.sh [--deps | --full]

  (nothing)   release build and the quick tests
  --full      also: formatting, clang-tidy, AddressSanitizer + UndefinedBehaviorSanitizer, ThreadSanitizer and
              the slow tests (large Monte Carlo, soak)
  --deps      only install the Debian packages that all of this needs

Set STRIPER_BUILD to build somewhere else than in ./build.
TXT
}

build=${STRIPER_BUILD:-build}
export CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-$(nproc)}
export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime

configure_and_build() { # preset
  cmake --preset "$1" -B "$build/$1" >"$build/$1.log" 2>&1 || { cat "$build/$1.log" >&2; return 1; }
  cmake --build "$build/$1"
}

run_quick() {
  configure_and_build release
  ctest --test-dir "$build/release" --output-on-failure -LE slow
}

run_full() {
  tests/lint/format.sh
  ctest --test-dir "$build/release" --output-on-failure -L slow --no-tests=ignore
  local sanitizer
  for sanitizer in asan tsan; do
    configure_and_build "$sanitizer"
    ctest --test-dir "$build/$sanitizer" --output-on-failure -L quick
  done
  configure_and_build tidy
}

mkdir -p "$build"
case "${1:-}" in
  --deps) install_packages "${packages_to_build[@]}" "${packages_to_test[@]}" "${packages_to_test_fully[@]}" ;;
  --full)
    install_packages "${packages_to_build[@]}" "${packages_to_test[@]}" "${packages_to_test_fully[@]}"
    run_quick
    run_full
    ;;
  "")
    install_packages "${packages_to_build[@]}" "${packages_to_test[@]}"
    run_quick
    ;;
  -h | --help) usage ;;
  *) usage >&2; exit 2 ;;
esac
