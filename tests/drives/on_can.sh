#!/usr/bin/env bash
# on_can.sh IN_VM PROGRAM [ARG...]: runs PROGRAM where there is a vcan0: here, or inside tools/in-vm. Neither: status 77,
# which ctest reports as skipped. BEVEL_NO_VM=1 keeps it out of the guest (sanitized programs do not run in there).
set -u
in_vm=$1
shift
[ -e /sys/class/net/vcan0 ] && exec "$@"
skip() {
  echo "SKIPPED: $*"
  echo "SKIPPED: nothing was tested on SocketCAN. Give this machine a vcan0, or install what tools/in-vm asks for."
  exit 77
}
[ -z "${BEVEL_NO_VM:-}" ] || skip "no vcan0 here, and this build does not run inside user-mode Linux"
command -v linux.uml >/dev/null && [ -x /bin/busybox ] && command -v ip >/dev/null ||
  skip "no vcan0 here, and no user-mode-linux, busybox-static and iproute2 for tools/in-vm"
"$in_vm" -t 240 "$@"
status=$?
[ $status = 126 ] && skip "tools/in-vm is missing something (see above)"
exit $status
