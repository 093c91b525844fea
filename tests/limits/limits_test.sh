#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Starts each program under resource limits that are too low, in a network namespace. Each run must end by itself, with
# status 1 and a message that names the limit and the remedy; a crash and a hang have a status of 128 and more.
# Usage: limits_test.sh BIN_DIR SOURCE_DIR. Exit status 77: skipped, no network namespaces.
set -uo pipefail
bin=$1 source=$2
if [ -z "${BEVEL_ISOLATED:-}" ]; then
  if ! unshare -rn true 2>/dev/null; then echo "SKIPPED: no network namespaces here (unshare -rn)"; exit 77; fi
  exec env BEVEL_ISOLATED=1 unshare -rn sh -c \
    'ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"' sh "$0" "$@"
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
sed "s#/tmp/bevel-demo#$work/s#g" "$source/config/demo.toml" >"$work/demo.toml"
log=$source/examples/stick_slip/rec01.lcm model=$source/examples/stick_slip/model.toml
failures=0 longest_s=20

# run WHAT LIMIT ALLOWED_STATUSES PATTERN COMMAND...: under the limit, given as a command of the shell
run() {
  local what=$1 limit=$2 allowed=$3 pattern=$4; shift 4
  (eval "$limit"; exec timeout -s KILL "$longest_s" "$@") >"$work/out.txt" 2>&1 </dev/null
  local status=$?
  case " $allowed " in *" $status "*) ;; *) echo "FAILED: $what: status $status, allowed $allowed"; cat "$work/out.txt"; failures=$((failures + 1)); return ;; esac
  if [ $status -eq 1 ] && ! grep -qE "$pattern" "$work/out.txt"; then
    echo "FAILED: $what: the message names no limit"; cat "$work/out.txt"; failures=$((failures + 1))
  fi
}

nodes="bevel-camera bevel-estimator bevel-controller bevel-stepper bevel-rig"
for n in 5 6 7 8 9 10 12 16 24 32 40; do
  for program in $nodes; do
    run "$program, ulimit -n $n" "ulimit -n $n" "1" "raise it: ulimit -n" "$bin/$program" --config "$work/demo.toml"
  done
done
files="ulimit -n 8"
run "bevel-demo, $files" "$files" "1" "ulimit -n" "$bin/bevel-demo" --config "$work/demo.toml" --out "$work/demo"
run "bevel-view, $files" "$files" "1" "ulimit -n" "$bin/bevel-view" --port 0
run "bevel-check, $files" "$files" "1" "ulimit -n" "$bin/bevel-check" --config "$work/demo.toml"
run "bevel-replay, $files" "$files" "1" "ulimit -n" "$bin/bevel-replay" --model "$model" "$log"
run "bevel-predict, $files" "$files" "1" "ulimit -n" "$bin/bevel-predict" --model "$model" "$log"
run "bevel-export, $files" "$files" "1" "ulimit -n" "$bin/bevel-export" "$log" --out "$work/csv"
run "bevel-diagnose, $files" "$files" "1" "ulimit -n" "$bin/bevel-diagnose" --model "$model" --out "$work/verdict" "$log" "$log"
run "bevel-identify, $files" "$files" "1 2" "ulimit -n" "$bin/bevel-identify" "$log"

# Address space, from less than the loader needs (status 127) to more than a node needs (137: it runs, and is ended).
# These three programs do not load OpenCV, whose size varies.
longest_s=3
for kilobytes in 34000 40000 46000 60000 90000 120000; do
  for program in bevel-estimator bevel-controller bevel-stepper; do
    run "$program, ulimit -v $kilobytes" "ulimit -v $kilobytes" "1 127 137" "ulimit -v" "$bin/$program" \
      --config "$work/demo.toml"
  done
done
longest_s=20

# The multicast route is missing: a message, no crash. Another network namespace, without a route.
for program in $nodes bevel-view; do
  arguments="--config $work/demo.toml"; [ $program = bevel-view ] && arguments="--port 0"
  # shellcheck disable=SC2086
  run "$program, no route" "true" "1" "docs/running.md" unshare -rn "$bin/$program" $arguments
done

# A folder that cannot be written, and a limit of file sizes. Root writes everywhere but to /proc.
run "bevel-demo, no folder" "true" "1" "/proc/bevel" "$bin/bevel-demo" --config "$work/demo.toml" --out /proc/bevel

[ $failures -eq 0 ] || exit 1
echo "ok"
