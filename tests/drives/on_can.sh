#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# on_can.sh IN_VM PROGRAM [ARG...]: runs PROGRAM where there is a vcan0: here, or inside tools/in-vm. Neither: status 77,
# which ctest reports as skipped. BEVEL_VM is that of tools/in-vm; none keeps it out of any guest (sanitized programs do
# not run in user-mode Linux).
set -u
in_vm=$1
shift
[ -e /sys/class/net/vcan0 ] && { echo "on_can.sh: vcan0 of this machine" >&2; exec "$@"; }
command -v "$1" >/dev/null || { echo "on_can.sh: cannot run $1" >&2; exit 127; }  # not to be taken for a missing guest
"$in_vm" -t 500 "$@"
status=$?
if [ $status = 126 ]; then
  echo "SKIPPED: no vcan0 here, and no guest that has one (see above)."
  echo "SKIPPED: nothing was tested on SocketCAN. Give this machine a vcan0, or call tools/setup --vm."
  exit 77
fi
exit $status
