#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# check_test.sh BIN_DIR SOURCE_DIR: bevel-check with the real processes, in a network namespace: a good rig, a camera
# that is too slow, no bus, no multicast; its exit status and what it says to type. Status 77: skipped; it says why.
set -uo pipefail
bin=$1 source=$2
if [ -z "${BEVEL_ISOLATED:-}" ]; then
  if ! unshare -rn true 2>/dev/null; then echo "SKIPPED: no network namespaces here (unshare -rn)"; exit 77; fi
  exec env BEVEL_ISOLATED=1 unshare -rn sh -c 'ip link set lo up && exec "$@"' sh "$0" "$@"
fi
work=$(mktemp -d) rig='' camera=''
trap 'kill $rig $camera 2>/dev/null; wait; rm -rf "$work"' EXIT
sed "s#/tmp/bevel-demo#$work/s#g" "$source/config/demo.toml" >"$work/demo.toml"
expect() {  # expect STATUS TEXT...: of bevel-check
  local status=$1 got text
  shift
  "$bin/bevel-check" --config "$work/demo.toml" >"$work/said" 2>&1
  got=$?
  for text in "$@"; do
    grep -qE -- "$text" "$work/said" || { echo "FAILED: nothing of '$text'"; cat "$work/said"; exit 1; }
  done
  [ $got = "$status" ] || { echo "FAILED: status $got instead of $status"; cat "$work/said"; exit 1; }
}

expect 1 '^FAILED  multicast' 'ip route add 224.0.0.0/4 dev lo' '^FAILED  bus' "bevel-rig --config $work/demo.toml"

ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo
"$bin/bevel-rig" --config "$work/demo.toml" & rig=$!
"$bin/bevel-camera" --config "$work/demo.toml" & camera=$!
sleep 1.5
expect 0 '^ok +multicast' '^ok +camera 0' '^ok +camera 1' '^ok +bus' '^ok +insertion drive' '^ok +rotation heartbeat' '^ok +timer'
cat "$work/said"

kill $camera && wait $camera
"$bin/bevel-camera" --config "$work/demo.toml" --fault camera:slow@0.1s & camera=$!
sleep 1.5
expect 1 '^FAILED  camera 0' 'v4l2-ctl'
"$bin/bevel-check" --help | grep -q -- --config || { echo "FAILED: --help"; exit 1; }
"$bin/bevel-check" --config "$work/none.toml" >/dev/null 2>&1 && { echo "FAILED: took a file that is not there"; exit 1; }
exit 0
