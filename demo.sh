#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds of the program what this needs, scans the simulated cluttered room and draws it.
set -euo pipefail
cd "$(dirname "$0")"
. tools/deps.sh

usage() {
  cat <<'TXT'
usage: ./demo.sh [--deps]

  (nothing)   build the striper program without cameras and calibration, scan the simulated room,
              draw the scan
  --deps      only install the Debian packages that this needs

Set STRIPER_BUILD to build somewhere else than in ./build.
TXT
}

build=${STRIPER_BUILD:-build}
export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
results=$build/demo-results

build_program() {
  mkdir -p "$build"
  cmake -S . -B "$build/demo" -G Ninja -DCMAKE_BUILD_TYPE=Release -DSTRIPER_TESTS=OFF -DSTRIPER_CALIBRATION=OFF \
    -DSTRIPER_WITH_ARAVIS=OFF -DSTRIPER_WITH_V4L2=OFF -DSTRIPER_WITH_ROS2=OFF -DSTRIPER_PYTHON=OFF \
    >"$build/demo.log" 2>&1 || { cat "$build/demo.log" >&2; return 1; }
  cmake --build "$build/demo" --target striper striper_web --parallel "$(nproc)"
}

scan_room() {
  local striper=$build/demo/apps/striper/striper scene=data/scenes/room.yaml
  rm -rf "$results"
  "$striper" simulate "$scene" -o "$results/room" --frames 3
  "$striper" capture "sim:$scene" --model "$results/room/model.yaml" --frames 3 -o "$results/scans.csv"
}

draw() {
  gnuplot -c apps/plot/scan.gp "$results/scans.csv" "$results/scan.svg"
  gnuplot -c apps/plot/scan.gp "$results/scans.csv" "$results/scan.png"
  gnuplot -c apps/plot/picture.gp "$results/room/00000000.png" "$results/scans.csv" \
    "$results/camera.png"
}

case "${1:-}" in
  --deps) install_packages "${packages_to_demo[@]}" ;;
  "")
    install_packages "${packages_to_demo[@]}"
    build_program
    scan_room
    draw
    results=$(cd "$results" && pwd)
    cat <<TXT

The cluttered room, scanned by the simulated striper:
  $results/scans.csv   a line per return: bearing, range, error bars, x, y, ...
  $results/scan.svg    the room from above with its error bars (also scan.png)
  $results/camera.png  what the camera saw, and the stripe that was found in it
  $results/room        the images, their model and their exact truth

Live in a browser, at http://127.0.0.1:8765/:
  $build/demo/apps/striper/striper serve 'sim:data/scenes/room.yaml?realtime=yes' -m $results/room/model.yaml --to web:8765
TXT
    ;;
  -h | --help) usage ;;
  *) usage >&2; exit 2 ;;
esac
