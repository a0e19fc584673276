#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Proves the program from outside on the virtual driver: what the simulator writes, sent as NTSC and
# captured live, gives the CSV that the same pictures give from files, to 1e-9 m; `devices` finds the
# camera and sees the laser in its field; errors end with their exit codes.
set -euo pipefail
striper=$1 transmit=$2 source_dir=$3
camera='v4l2:/dev/video0?input=0&standard=ntsc-m&format=GREY'
work=$(mktemp -d)

fail() { echo "FAILED: $*"; exit 1; }

"$striper" simulate "$source_dir/data/scenes/ntsc_grabber.yaml" -o "$work/sim" --frames 1
picture=$(find "$work/sim" -name '*.png' | sort | head -1)
mkdir "$work/files"
for number in 0 1 2 3 4; do cp "$picture" "$work/files/picture$number.png"; done
"$striper" capture "images:$work/files?fps=29.97&fields=split-bottom&laser=0,dark" --model "$work/sim/model.yaml" \
  -o "$work/files.csv"

"$transmit" grey_interlaced 1000 "$picture" >"$work/transmit.log" &
until grep -q sending "$work/transmit.log"; do kill -0 $! || fail "the transmitter ended"; sleep 0.1; done

"$striper" capture "$camera&laser=0,dark" --model "$work/sim/model.yaml" --frames 40 -o "$work/live.csv"
python3 - "$work/files.csv" "$work/live.csv" <<'PY'
import csv, sys
def frames(path):
    scans = {}
    for row in csv.DictReader(open(path)):
        scans.setdefault(int(row['frame']), {})[row['u_px']] = float(row['range_m'])
    return scans
expected = frames(sys.argv[1])[2]
live = frames(sys.argv[2])
alike = sum(1 for scan in live.values() if scan.keys() == expected.keys()
            and max(abs(scan[u] - expected[u]) for u in scan) <= 1e-9)
print(f'{alike} of {len(live)} live scans are those from files to 1e-9 m, {len(expected)} returns each')
sys.exit(0 if len(expected) > 500 and alike >= 25 else 1)
PY

"$striper" capture "$camera" --model "$work/sim/model.yaml" --frames 40 -o "$work/auto.csv"
[ "$(wc -l <"$work/auto.csv")" -gt 5000 ] || fail "without laser= the lit field is not found"

"$striper" devices | tee "$work/devices.txt"
grep -q '^v4l2:/dev/video0$' "$work/devices.txt" || fail "devices does not list the camera"
"$striper" devices --json | python3 -c 'import json, sys; assert len(json.load(sys.stdin)["cameras"]) >= 2'
"$striper" devices --check-sync "$camera" --seconds 6 | tee "$work/sync.txt"
grep -q 'in the bottom field, the first exposure of two' "$work/sync.txt" || fail "sync is not seen"

status=0
"$striper" devices --check-sync 'v4l2:/dev/video0?input=1&size=640x360' --seconds 4 || status=$?
[ "$status" -eq 3 ] || fail "a webcam without a laser should end with 3, not $status"
for wrong in /dev/video77 /dev/null /dev/video1; do
  status=0
  "$striper" capture "v4l2:$wrong" --frames 1 2>"$work/error.txt" || status=$?
  cat "$work/error.txt"
  [ "$status" -eq 1 ] || fail "$wrong should end with 1, not $status"
done
echo "all of it as it should be"
