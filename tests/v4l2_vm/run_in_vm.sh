#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs a command inside a small virtual machine that has the kernel's virtual video driver.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)

usage() {
  cat <<'TXT'
usage: run_in_vm.sh [--seconds N] [--memory MB] [--vivid "OPTIONS"]... [--module NAME]... -- COMMAND [ARG...]

Boots a Debian kernel under QEMU with the host's own root (read-only, a scratch layer over it), so
that the host's build runs inside unchanged; runs COMMAND as root in this folder; prints what it
prints and returns its exit status. Nothing that it writes reaches the host. Where there can be no
such machine (no QEMU, no kernel to be had) it says why and returns 77, which ctest reports as skipped.

  --seconds N        give up after this long (180); status 124
  --memory MB        of the machine (1024)
  --vivid "OPTIONS"  load the kernel's `vivid` with these module options; the default is none
  --module NAME      load another of the kernel's modules: vcan, sch_netem

Kernel and QEMU come by Debian package name (see kernel.sh). Software emulation: about 9 s for
`run_in_vm.sh -- true`; one machine at a time.
TXT
}

seconds=180 memory=1024 setup=()
while [ $# -gt 0 ]; do
  case $1 in
    --seconds) seconds=$2; shift 2 ;;
    --memory) memory=$2; shift 2 ;;
    --vivid) setup+=("insmod /run/striper_vm/vivid.ko $2"); shift 2 ;;
    --module) setup+=("insmod /run/striper_vm/$2.ko"); shift 2 ;;
    -h | --help) usage; exit 0 ;;
    --) shift; break ;;
    *) usage >&2; exit 2 ;;
  esac
done
[ $# -gt 0 ] || { usage >&2; exit 2; }
command -v qemu-system-x86_64 >/dev/null || {
  echo "run_in_vm.sh: qemu-system-x86_64 is missing: ./test.sh --deps installs it" >&2
  exit 77
}

machine=$("$here/kernel.sh") || exit 77
exec 9>"$machine/one_at_a_time.lock" && flock 9

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
{
  echo "export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root STRIPER_IN_VM=1"
  echo "date -s @$(date +%s) >/dev/null; cd $(printf %q "$PWD")"
  [ ${#setup[@]} -eq 0 ] || printf '%s || exit 1\n' "${setup[@]}"
  printf '%q ' "$@"
} >"$work/script.sh"

# Needs no /dev/kvm: the accelerator of some machines hangs; plain emulation never does.
timeout --foreground -k 5 "$seconds" nice -n "${STRIPER_VM_NICE:-5}" qemu-system-x86_64 \
  -machine q35 -accel tcg,thread=multi -cpu max -m "$memory" -smp 2 -nographic -no-reboot -net none \
  -kernel "$machine/vmlinuz" -initrd "$machine/initrd.gz" \
  -virtfs local,path=/,mount_tag=hostroot,security_model=none,readonly=on,multidevs=remap \
  -append "console=ttyS0 quiet loglevel=2 panic=-1 mitigations=off striper.script=$work/script.sh" \
  </dev/null 2>"$work/qemu_errors" | stdbuf -oL tr -d '\r' | tee "$work/console" |
  awk '/STRIPER_VM_EXIT=/ { exit } begun { print; fflush() } /STRIPER_VM_BEGIN/ { begun = 1 }' && timed=0 || timed=${PIPESTATUS[0]}

status=$(sed -n 's/^STRIPER_VM_EXIT=\([0-9]*\)$/\1/p' "$work/console" | tail -1)
if [ -n "$status" ]; then exit "$status"; fi
if [ "$timed" -eq 124 ]; then
  echo "run_in_vm.sh: not finished after $seconds s" >&2
  exit 124
fi
echo "run_in_vm.sh: the machine ended without a result; its last lines:" >&2
tail -n 20 "$work/console" "$work/qemu_errors" >&2
exit 1
