#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# in_vm_test.sh IN_VM ON_CAN: the contract of tools/in-vm that the CAN tests rely on: whose status comes out, when another
# way to a kernel is tried, and that what is not tested is said. Status 77: no guest boots here, so only the half was seen.
set -u
in_vm=$1 on_can=$2
refuse_xstate=$(dirname "$in_vm")/vm/refuse-xstate
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
expect() {  # expect STATUS TEXT COMMAND...: the command ends with the status, and says the text
  local status=$1 text=$2 got
  shift 2
  "$@" >"$work/said" 2>&1
  got=$?
  if [ $got = "$status" ] && grep -q -- "$text" "$work/said"; then return; fi
  echo "FAILED: status $got instead of $status, or nothing of '$text': $*"
  sed 's/^/    /' "$work/said"
  failed=1
}

# Without a guest: skipped, aloud.
expect 126 'BEVEL_VM=none' env BEVEL_VM=none "$in_vm" true
expect 126 'none of uml' env BEVEL_VM=vmware "$in_vm" true
[ -e /sys/class/net/vcan0 ] || expect 77 'SKIPPED: nothing was tested' env BEVEL_VM=none "$on_can" "$in_vm" true
expect 127 'no/such/program' env BEVEL_VM=none "$on_can" "$in_vm" no/such/program

# Kernels that end before the command begins: all ways are tried, and it is skipped; the one that was asked for fails.
mkdir "$work/bin"
printf '#!/bin/sh\nexit 134\n' | tee "$work/bin/linux.uml" >"$work/bin/qemu-system-x86_64"
chmod +x "$work"/bin/*
# shellcheck disable=SC2317  # called by expect
broken() { env -u BEVEL_VM PATH="$work/bin:$PATH" "$@"; }
expect 126 'no kernel with SocketCAN' broken "$in_vm" true
[ -e /sys/class/net/vcan0 ] || expect 77 'SKIPPED' broken "$on_can" "$in_vm" true
expect 125 'before the command began' broken BEVEL_VM=uml "$in_vm" true

# Tools that are not there: what to install is said, for each way, and it is skipped.
mkdir "$work/without"
ln -s /usr/bin/* /bin/* "$work/without/" 2>/dev/null
rm -f "$work"/without/linux.uml "$work"/without/qemu-system-x86_64
# shellcheck disable=SC2317  # called by expect
without() { env -u BEVEL_VM PATH="$work/without:/usr/sbin:/sbin" "$@"; }
expect 126 'install user-mode-linux' without "$in_vm" true
expect 126 'install qemu-system-x86' without "$in_vm" true
[ -e /sys/class/net/vcan0 ] || expect 77 'SKIPPED' without "$on_can" "$in_vm" true

# With a guest.
skip() {  # skip WHY: what was seen without a guest still counts
  cat "$work/boot"
  [ $failed = 0 ] || exit 1
  echo "SKIPPED: $1"
  exit 77
}
SECONDS=0
"$in_vm" -t 60 true >"$work/boot" 2>&1
[ $? != 126 ] || skip "no guest boots here"
[ $SECONDS -le 60 ] || skip "a guest took $SECONDS s here: six more would take too long"
expect 7 'vcan0' "$in_vm" -t 60 sh -c 'ls /sys/class/net; exit 7'
expect 7 'vcan0 of this machine' "$in_vm" -t 60 "$on_can" /no/such/in-vm sh -c 'exit 7'
expect 124 'begun' "$in_vm" -t 3 sh -c 'echo begun; sleep 300'
expect 125 'ended under the command' "$in_vm" -t 60 /bin/busybox poweroff -f
mkdir "$work/kept"
expect 0 '' "$in_vm" -t 60 -o "$work/kept" sh -c "echo kept >'$work/kept/file'; echo dropped >'$work/file'"
if [ "$(cat "$work/kept/file")" != kept ] || [ -e "$work/file" ]; then
  echo "FAILED: writes inside and outside of the -o folder"
  failed=1
fi

# On a processor that looks too wide to user-mode Linux: its cure is found.
if grep -q '^in-vm: uml' "$work/boot"; then
  expect 7 '^in-vm: uml-no-xstate$' "$refuse_xstate" --too-wide "$in_vm" -t 60 sh -c 'exit 7'
fi
exit $failed
