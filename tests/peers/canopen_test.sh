#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# canopen_test.sh BIN_DIR SOURCE_DIR TEST [CLASS]: TEST.py of this folder, python-canopen against programs of the project, where
# nobody else hears their LCM and their CAN: in a network namespace of its own, or in a machine that has no network but
# lo and CAN (tools/in-vm). With BEVEL_CAN=vcan0 on that interface, else on a local bus. Status 77: skipped; it says why.
set -uo pipefail
bin=$(realpath "$1") source=$(realpath "$2") test=$3
networks() { for n in /sys/class/net/*; do case ${n##*/} in lo | vcan* | sit* | tunl* | ip6tnl*) ;; *) echo "${n##*/}" ;; esac; done; }
alone() { [ -n "${BEVEL_CAN:-}" ] && [ -e "/sys/class/net/$BEVEL_CAN" ] && [ -z "$(networks)" ]; }
if [ -z "${BEVEL_ISOLATED:-}" ] && ! alone; then
  if ! unshare -rn true 2>/dev/null; then echo "SKIPPED: no network namespaces here (unshare -rn)"; exit 77; fi
  exec env BEVEL_ISOLATED=1 unshare -rn sh -c 'ip link set lo up && ip link set lo multicast on &&
    ip route add 224.0.0.0/4 dev lo &&
    { [ -z "${BEVEL_CAN:-}" ] || { ip link add "$BEVEL_CAN" type vcan && ip link set "$BEVEL_CAN" up; }; } &&
    exec "$@"' sh "$0" "$@"
fi
export BEVEL_BIN=$bin BEVEL_SOURCE=$source PYTHONDONTWRITEBYTECODE=1
export PYTHONPATH=$source/.deps/python:$source/.deps/lcm:$(dirname "$bin")/lcmtypes/python
exec python3 "$source/tests/peers/$test.py" "${@:4}"
