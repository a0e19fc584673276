#!/bin/busybox sh
# SPDX-License-Identifier: Apache-2.0
# First process of the virtual machine: loads the modules, puts a scratch layer over the host's
# read-only root, runs the script that the kernel's command line names and switches off.
export PATH=/bin:/sbin:/usr/bin:/usr/sbin
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev

while read -r module; do
  case $module in
    vivid.ko | vcan.ko | sch_netem.ko) ;; # the script loads these, with its own options
    *) insmod "/modules/$module" ;;
  esac
done </modules/order

mkdir -p /lower /layer /root_of_host
mount -t 9p -o trans=virtio,version=9p2000.L,msize=1048576,cache=loose,ro hostroot /lower
mount -t tmpfs -o size=400m layer /layer
mkdir -p /layer/upper /layer/work
mount -t overlay -o lowerdir=/lower,upperdir=/layer/upper,workdir=/layer/work overlay /root_of_host
mkdir -p /root_of_host/run/striper_vm
mount -t tmpfs tmp /root_of_host/run/striper_vm
cp /modules/* /root_of_host/run/striper_vm/
for folder in dev proc sys; do mount --move /$folder /root_of_host/$folder; done
mkdir -p /root_of_host/dev/shm && mount -t tmpfs shm /root_of_host/dev/shm
ip link set lo up

echo STRIPER_VM_BEGIN
chroot /root_of_host /bin/bash "$(sed -n 's/.*striper\.script=\([^ ]*\).*/\1/p' /root_of_host/proc/cmdline)"
echo "STRIPER_VM_EXIT=$?"
sync
poweroff -f
