#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Proves the way from a live camera to a model: the simulated session of data/calibration is held before
# an NTSC camera, pose after pose, as a person would; `record --when-board` keeps one image of each
# and `calibrate` makes a model of them that agrees with the truth within its own error bars. Five poses,
# an emulated machine being slow; POSES=7 shows more.
set -euo pipefail
striper=$1 transmit=$2 source_dir=$3
. "$source_dir/tests/v4l2_vm/air.sh"

poses=("$source_dir"/data/calibration/*.png)
poses=("${poses[@]:0:${POSES:-5}}")
on_air grey_interlaced "${poses[0]}"
"$striper" record 'v4l2:/dev/video0?input=0&standard=ntsc&format=GREY&queue=1&stall_s=30' --when-board 9x6 -o "$work/session" &
recorder=$!

while_it_records() { kill -0 "$recorder" 2>/dev/null || fail "the recording ended"; }
until pgrep '^vivid-.*-vid-c' >/dev/null; do
  while_it_records
  sleep 0.1
done
let_driver_wait

kept() { find "$work/session" -name '*.png' 2>/dev/null | wc -l; }

number=0
for pose in "${poses[@]}"; do
  send "$pose"
  number=$((number + 1))
  until [ "$(kept)" -ge "$number" ]; do
    while_it_records
    sleep 0.1
  done
done
sleep 1 # A pose that stays is not kept again.
kill -INT "$recorder"
wait "$recorder" || fail "the recording ends with $?"
off_air
[ "$(kept)" -eq "${#poses[@]}" ] || fail "$(kept) images were kept of ${#poses[@]} poses"

"$striper" calibrate --board 9x6 --square 0.06 --lens plumb_bob --lasers "$work/session" -o "$work/striper.yaml" --json |
  tee "$work/summary.json"

# The session's images lie in the middle of the camera's: the truth is moved with them.
python3 - "$source_dir/data/calibration/truth.yaml" "$work/truth.yaml" <<'PY'
import re, sys
text = open(sys.argv[1]).read()
width, height = (int(re.search(rf'image_{side}: (\d+)', text).group(1)) for side in ('width', 'height'))
text = text.replace(f'image_width: {width}', 'image_width: 720').replace(f'image_height: {height}', 'image_height: 480')
def moved(match):
    k = [float(number) for number in match.group(2).split(',')]
    k[2] += (720 - width) // 2
    k[5] += (480 - height) // 2
    return match.group(1) + ', '.join(map(repr, k)) + ']'
text = re.sub(r'(camera_matrix:.*?data: \[)([^\]]*)\]', moved, text, count=1, flags=re.S)
open(sys.argv[2], 'w').write(text)
PY
"$striper" diff "$work/truth.yaml" "$work/striper.yaml" --max-range 3 --json >"$work/difference.json"
python3 - "$work/summary.json" "$work/difference.json" "${#poses[@]}" <<'PY'
import json, sys
summary, difference = (json.load(open(path)) for path in sys.argv[1:3])
assert summary['trustworthy'] and summary['views'] == summary['stripes'] == int(sys.argv[3]), summary['verdict']
sigma = {s['range_m']: s['sigma_m'] for s in summary['range_sigmas'][0]}[2.0]
seen = [abs(p['difference_m']) for p in difference['pixels'] if 1.6 < p['range_m'] < 2.0 and 220 < p['u_px'] < 500]
print(f'{len(seen)} pixels at 1.6 to 2 m differ from the truth by at most {max(seen):.5f} m; sigma {sigma:.5f} m')
assert sigma < 0.002 and max(seen) < 4.0 * sigma
PY
