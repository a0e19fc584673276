# SPDX-License-Identifier: Apache-2.0
# Sourced by the tests of the program: an image on the air of the virtual driver, and a place to work.
work=$(mktemp -d)

fail() { echo "FAILED: $*"; exit 1; }

# Begins to send in a way that vivid_transmit knows; ends what was sent before.
on_air() { # WAY IMAGE_FILE
  off_air
  rm -f "$work/air" "$work/sent"
  mkfifo "$work/air"
  "$transmit" "$1" <"$work/air" >"$work/sent" &
  transmitter=$!
  exec 3>"$work/air"
  send "$2"
}

send() { # IMAGE_FILE
  echo "$1" >&3
  until [ "$(tail -n 1 "$work/sent" 2>/dev/null)" = "$1" ]; do
    kill -0 "$transmitter" 2>/dev/null || fail "the transmitter ended"
    sleep 0.1
  done
}

off_air() {
  [ -n "${transmitter:-}" ] || return 0
  exec 3>&-
  wait "$transmitter"
  transmitter=
}

# The virtual driver waits by spinning, on both sides of it: in an emulated machine of two processors
# there is little left for anybody else. For what computes and can do with late frames.
let_driver_wait() { renice -n 19 -p $(pgrep '^vivid-') >/dev/null; }
