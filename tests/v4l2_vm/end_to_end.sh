#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Proves the program from outside on the virtual driver: what the simulator writes, sent as television
# and captured live, gives the scans that the same images give from files, to 1e-9 m; `devices` finds
# the camera and sees the laser in its field; a recording gives the scans that were made live; errors
# end with their exit codes.
set -euo pipefail
striper=$1 transmit=$2 source_dir=$3
. "$source_dir/tests/v4l2_vm/air.sh"

render() { "$striper" simulate "$2" -o "$work/$1" --frames 1; } # NAME SCENE

# Captures live and then, from files, the same image with the numbers of those that were read live: an
# emulated machine does not always read them all in time. Both must give the same scans.
same_scans() { # NAME WAY STANDARD QUERY
  local directory=$work/$1 files=$work/files
  on_air "$2" "$(find "$directory" -name '*.png')"
  "$striper" capture "v4l2:/dev/video0?input=0&standard=$3&laser=0,dark&$4" --model "$directory/model.yaml" \
    --frames 15 -o "$work/live.csv"
  rm -rf "$files" && mkdir "$files" && cp "$directory"/*.png "$files"
  python3 - "$work/live.csv" "$directory/frames.csv" >"$files/frames.csv" <<'PY'
import csv, sys
numbers = sorted({int(row['frame']) for row in csv.DictReader(open(sys.argv[1]))})
rows = csv.DictReader(open(sys.argv[2]))
row = next(rows)
table = csv.DictWriter(sys.stdout, rows.fieldnames)
table.writeheader()
for number in numbers:
    table.writerow({**row, 'sequence': number, 'monotonic_ns': 2 * int(row['field_period_ns']) * number})
PY
  "$striper" capture "images:$files" --model "$directory/model.yaml" -o "$work/files.csv"
  python3 - "$work/live.csv" "$work/files.csv" "$2" <<'PY'
import csv, sys
def returns(path):
    return {(row['frame'], row['u_px']): float(row['range_m']) for row in csv.DictReader(open(path))}
live, files, way = returns(sys.argv[1]), returns(sys.argv[2]), sys.argv[3]
worst = max(abs(live[key] - files[key]) for key in live.keys() & files.keys())
print(f'{way}: {len(live)} live returns, {len(files)} from files; ranges differ by at most {worst:.2g} m')
sys.exit(0 if live.keys() == files.keys() and len(live) > 5000 and worst <= 1e-9 else 1)
PY
}

sed 's/height: 480/height: 576/; s/bottom-first/top-first/; s/29.97[0-9]*/25/' \
  "$source_dir/data/scenes/ntsc_grabber.yaml" >"$work/pal_grabber.yaml"
render ntsc "$source_dir/data/scenes/ntsc_grabber.yaml"
render pal "$work/pal_grabber.yaml"
same_scans pal pal_interlaced pal 'format=GREY'
same_scans ntsc yuyv_interlaced ntsc 'format=YUYV'
same_scans ntsc grey_interlaced ntsc 'format=GREY'

camera='v4l2:/dev/video0?input=0&standard=ntsc&format=GREY'
"$striper" capture "$camera" --model "$work/ntsc/model.yaml" --frames 20 -o "$work/auto.csv"
[ "$(wc -l <"$work/auto.csv")" -gt 5000 ] || fail "without laser= the lit field is not found"

"$striper" record "$camera&laser=0,dark" --model "$work/ntsc/model.yaml" --frames 20 -o "$work/run.mcap"
"$striper" convert "$work/run.mcap" -o "$work/live.csv" --missing
"$striper" capture "mcap:$work/run.mcap" --model "$work/ntsc/model.yaml" --missing -o "$work/replayed.csv"
cmp "$work/live.csv" "$work/replayed.csv" || fail "recorded frames give other scans than were made live"
[ "$(grep -c ',ok$' "$work/live.csv")" -gt 5000 ] || fail "the recording has too few returns"

"$striper" devices | tee "$work/devices.txt"
grep -q '^v4l2:/dev/video0$' "$work/devices.txt" || fail "devices does not list the camera"
"$striper" devices --json | python3 -c 'import json, sys; assert len(json.load(sys.stdin)["cameras"]) >= 2'
"$striper" devices --check-sync "$camera" --seconds 30 | tee "$work/sync.txt"
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
off_air
echo "all of it as it should be"
