#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Proves guidance on a bus, in the virtual machine, on the kernel's virtual CAN interface: candump hears the frames that the same run
# gives as a log, in their order, at the pace of the run; an interface that is down, is none or is gone is said; a bus that is
# interrupted (Ctrl-C) has its guns off.
#
#   vcan.sh STRIPER
set -euo pipefail
striper=$1
run() { "$striper" guide run "$work/run" "$@" 2>"$work/said"; }
work=$(mktemp -d)
fail() { echo "FAILED: $*" >&2; exit 1; }
# Of a log, without its times and the interface's name; and its times alone. (The machine has no /dev/fd.)
frames() { awk '{ print $3 }' "$1" >"$1.frames"; }
times() { tr -d '()' <"$1" | awk '{ print $1 }' >"$1.times"; }

cat >"$work/road.yaml" <<'YAML'
striper_road: 1
length_m: 24
speed_m_s: 4
lines: [{dash_m: 3, gap_m: 4, begin_m: 4}]
YAML
"$striper" guide simulate "$work/road.yaml" -o "$work/run" 2>"$work/said"
ip link add dev vcan0 type vcan

status=0
run -o "$work/job" --to can:vcan0 || status=$?
[ "$status" -eq 1 ] && grep -q 'ip link set vcan0 up' "$work/said" || fail "an interface that is down is not said: $(cat "$work/said")"
status=0
run -o "$work/job" --to can:lo || status=$?
[ "$status" -eq 1 ] && grep -q "no CAN interface 'lo'" "$work/said" || fail "lo is no CAN interface: $(cat "$work/said")"
ip link set vcan0 up

run -o "$work/as-log" --to "candump:$work/log"
candump -L vcan0 >"$work/heard" &
listener=$!
sleep 1
begun=$(date +%s%N)
run -o "$work/job" --to can:vcan0
passed_ms=$((($(date +%s%N) - begun) / 1000000))
sleep 1
[ "$passed_ms" -ge 5900 ] || fail "a run of 6 s took $passed_ms ms: it was not played at its pace"
[ "$(wc -l <"$work/log")" -gt 3000 ] || fail "the log has too few frames"
frames "$work/log"
frames "$work/heard"
cmp "$work/log.frames" "$work/heard.frames" || fail "candump heard something else"
for name in lateral guns seen faults; do cmp "$work/job/$name.csv" "$work/as-log/$name.csv"; done

# Frames are heard about when they are of: gaps are those of the log within what an emulated machine delays.
times "$work/log"
times "$work/heard"
paste "$work/log.times" "$work/heard.times" | awk '
  NR == 1 { first_log = $1; first = $2 }
  { late = ($2 - first) - ($1 - first_log); if (late > most) most = late; if (late < least) least = late }
  END { printf "frames are heard %.1f to %.1f ms after their own times, beside the first\n", 1000 * least, 1000 * most; exit !(least > -0.05) }' ||
  fail "frames came before their times"

# Waits until something is heard that was not before.
heard_before=0
wait_for() { # PATTERN
  for _ in $(seq 300); do
    tail -n +$((heard_before + 1)) "$work/heard" | grep -q "$1" && return
    sleep 0.1
  done
  fail "$1 was never heard"
}

# A run that is interrupted while the gun is on.
heard_before=$(wc -l <"$work/heard")
"$striper" guide run "$work/run" -o "$work/job" --to can:vcan0 2>"$work/said" &
program=$!
wait_for ' 321#01'
kill -INT "$program"
wait "$program" || true
sleep 1
grep ' 321#' "$work/heard" | tail -n 1 | grep -q ' 321#0000' || fail "the last frame leaves a gun on: $(tail -n 1 "$work/heard")"

# The interface goes down under way: that is said at the end, and the tables are whole.
heard_before=$(wc -l <"$work/heard")
"$striper" guide run "$work/run" -o "$work/down" --to can:vcan0 2>"$work/said" &
program=$!
wait_for ' 321#'
ip link set vcan0 down
status=0
wait "$program" || status=$?
[ "$status" -eq 1 ] && grep -q 'were not sent: Network is down' "$work/said" || fail "a bus that went down is not said: $(cat "$work/said")"
cmp "$work/down/lateral.csv" "$work/as-log/lateral.csv"

kill "$listener" 2>/dev/null || true
echo "all of it as it should be"
