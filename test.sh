#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds the release and runs the tests.
set -euo pipefail
cd "$(dirname "$0")"
. tools/deps.sh

usage() {
  cat <<'TXT'
usage: ./test.sh [--deps | --full | --only STAGE]

  (nothing)      release build and the quick tests
  --full         all of that and every stage below
  --only STAGE   one stage: device, gige, format, asan, tsan, tidy, slow, foreign, browser
                 or fuzz
                   device  the kernel's video driver in a virtual machine, the virtual GigE camera and a
                           recording at full rate, one at a time; wants the machine to itself
                   gige    of these the virtual GigE camera alone
                   format  clang-format 14 has nothing to change
                   asan    the quick tests under AddressSanitizer and UndefinedBehaviorSanitizer
                   tsan    the quick tests under ThreadSanitizer
                   tidy    clang-tidy 14 has nothing to say
                   slow    large Monte Carlo and soak tests of the release build
                   foreign other people's programs read the files that we write; they come from npm, and the
                           stage says so where that is not reached
                   browser the pages of web: in Debian's Chromium
                   fuzz    libFuzzer on the readers of models, scenes, roads, image files, addresses, tables, messages, MCAP files and requests, 20 s each; not part
                           of --full
  --deps         only install the Debian packages that all of this needs

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

# Tests that state no limit of their own have one of 5 minutes, and of 25 where sanitizers slow them down.
run_tests() { # preset, options of ctest
  local preset=$1 limit_s=300 && shift
  [[ $preset == ?san ]] && limit_s=1500
  ctest --test-dir "$build/$preset" --output-on-failure --no-tests=error --timeout "$limit_s" "$@"
}

stage_quick() {
  configure_and_build release
  run_tests release -LE 'slow|device|foreign|browser'
}

# One at a time, and again where one fails: streams at full rate drop frames on a machine that does something else
# beside, and a computer that is shared with others does so unasked.
stage_device() {
  configure_and_build release
  run_tests release -L device -j 1 --repeat until-pass:3 "$@"
}

stage_gige() { stage_device -E 'v4l2_vm|RecordingThroughput'; }

stage_format() { tests/lint/format.sh; }

stage_asan() {
  configure_and_build asan
  run_tests asan -L quick -LE device
}

stage_tsan() {
  configure_and_build tsan
  export TSAN_OPTIONS="suppressions=$PWD/tests/support/tsan_suppressions.txt"
  run_tests tsan -L quick -LE device
}

stage_tidy() {
  cmake --preset tidy -B "$build/tidy"
  tests/lint/tidy.sh "$build/tidy"
}

stage_slow() {
  configure_and_build release
  run_tests release -L slow
}

stage_foreign() {
  configure_and_build release
  cmake --build "$build/release" --target foreign_programs
  run_tests release -L foreign --verbose
}

stage_browser() {
  configure_and_build release
  run_tests release -L browser
}

stage_fuzz() {
  cmake --preset fuzz -B "$build/fuzz"
  cmake --build "$build/fuzz" --target fuzzers
  run_tests fuzz -L fuzz
}

mkdir -p "$build"
all_packages=("${packages_to_build[@]}" "${packages_to_test[@]}" "${packages_to_test_fully[@]}")
case "${1:-}" in
  "")
    install_packages "${packages_to_build[@]}" "${packages_to_test[@]}"
    stage_quick
    ;;
  --full)
    install_packages "${all_packages[@]}"
    for stage in quick device format asan tsan tidy slow foreign browser; do "stage_$stage"; done
    ;;
  --only)
    case "${2:-}" in
      device | gige | format | asan | tsan | tidy | slow | foreign | browser | fuzz) install_packages "${all_packages[@]}"; "stage_$2" ;;
      *) usage >&2; exit 2 ;;
    esac
    ;;
  --deps) install_packages "${all_packages[@]}" ;;
  -h | --help) usage ;;
  *) usage >&2; exit 2 ;;
esac
