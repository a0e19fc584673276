#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Gets a Debian kernel with the modules that the virtual machine needs, by package name and without
# installing it, and packs its initramfs. Prints the folder that holds `vmlinuz` and `initrd.gz`.
# Kept in ${XDG_CACHE_HOME:-~/.cache}/striper, about 20 MB; the next run finds it there.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
cache=${XDG_CACHE_HOME:-$HOME/.cache}/striper
modules=(virtio_pci 9pnet_virtio 9p overlay vivid vcan can_raw sch_netem)

say() { echo "kernel.sh: $*" >&2; }
die() { say "$*"; exit 1; }

# The package that `linux-image-amd64` stands for today, linux-image-6.1.0-NN-amd64.
kernel_package() {
  apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/^ *Depends: \(linux-image-[0-9].*\)$/\1/p' | head -1
}

newest_cached() { { ls -d "$cache"/vm-*/ 2>/dev/null || true; } | sort -V | tail -1; }

# A folder of before a module was added to the list has it not; file names have - where modules may have _.
has_all_modules() { # folder
  local module
  for module in "${modules[@]}"; do
    tr - _ <"$1/modules/order" | grep -qx "$module.ko" || return 1
  done
}

fetch() { # package folder
  local package=$1 unpacked=$2/unpacked version=${1#linux-image-}
  say "fetching $package (once; kept in $cache)"
  (cd "$2" && apt-get download -qq -o APT::Sandbox::User=root "$package" >&2) ||
    die "cannot download $package: run 'apt-get update' or look at the network, then try again"
  dpkg -x "$2"/*.deb "$unpacked"
  depmod -b "$unpacked" "$version"
  mkdir -p "$2/modules"
  modprobe -d "$unpacked" -S "$version" --show-depends -a "${modules[@]}" |
    awk '$1 == "insmod" && !seen[$2]++ { print $2 }' | while read -r file; do
      cp "$file" "$2/modules/"
      basename "$file" >>"$2/modules/order"
    done
  cp "$unpacked/boot/vmlinuz-$version" "$2/vmlinuz"
  rm -rf "$unpacked" "$2"/*.deb
}

pack_initrd() { # folder
  local root=$1/initrd
  rm -rf "$root" && mkdir -p "$root"/{bin,modules,host,proc,sys,dev}
  cp "$(command -v busybox)" "$root/bin/busybox"
  cp "$1"/modules/* "$root/modules/"
  install -m 755 "$here/guest_init.sh" "$root/init"
  (cd "$root" && find . | busybox cpio -o -H newc 2>/dev/null | gzip -1) >"$1/initrd.gz.new"
  mv "$1/initrd.gz.new" "$1/initrd.gz"
  rm -rf "$root"
}

main() {
  [ "$(uname -m)" = x86_64 ] || die "the virtual machine is an amd64 one; this is $(uname -m)"
  export PATH=$PATH:/usr/sbin:/sbin
  local tool
  for tool in busybox depmod modprobe dpkg; do
    command -v "$tool" >/dev/null || die "$tool is missing: ./test.sh --deps installs it"
  done
  mkdir -p "$cache"
  exec 9>"$cache/kernel.lock" && flock 9

  local folder package
  folder=$(newest_cached)
  if [ -z "$folder" ] || ! has_all_modules "$folder"; then
    package=$(kernel_package)
    [ -n "$package" ] || die "apt knows no linux-image-amd64: run 'apt-get update' first"
    rm -rf "$cache/new" && mkdir -p "$cache/new"
    fetch "$package" "$cache/new"
    rm -rf "$cache/vm-${package#linux-image-}"
    mv "$cache/new" "$cache/vm-${package#linux-image-}"
    folder=$(newest_cached)
  fi
  folder=${folder%/}
  [ "$folder/initrd.gz" -nt "$here/guest_init.sh" ] || pack_initrd "$folder"
  echo "$folder"
}

main "$@"
