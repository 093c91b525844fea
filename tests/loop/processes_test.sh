#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The five processes for real, in a network namespace: an insertion that arrives, and all the ways in which one may end
# before. Usage: processes_test.sh BIN_DIR SOURCE_DIR CASE [ARG...]. Exit status 77: skipped, for want of network
# namespaces or of what the case needs; it says so.
set -uo pipefail
bin=$1 source=$2 case=$3
if [ -z "${BEVEL_ISOLATED:-}" ]; then
  # Where latencies are measured the root of a namespace of users will not do: it may not have SCHED_FIFO.
  as=-rn
  case $case in command_latency | realtime) unshare -n true 2>/dev/null && as=-n ;; esac
  if ! unshare $as true 2>/dev/null; then echo "SKIPPED: no network namespaces here (unshare -rn)"; exit 77; fi
  exec env BEVEL_ISOLATED=1 unshare $as sh -c \
    'ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"' sh "$0" "$@"
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Sockets of its own, so that a demo on the same machine is not disturbed.
sed "s#/tmp/bevel-demo#$work/s#g" "$source/config/demo.toml" >"$work/demo.toml"
demo=("$bin/bevel-demo" --config "$work/demo.toml" --out "$work/out")
fail() {
  echo "FAILED: $*"; cat "$work"/*.txt "$work"/out/*.txt 2>/dev/null
  for one in $(left_over); do kill "$one" 2>/dev/null; done
  exit 1
}
# Children of ours that still run; nobody else's.
left_over() { pgrep -f "$work/demo.toml" | grep -v "^$$\$"; }
wait_for() { for _ in $(seq 100); do grep -q "$1" "$work/demo.txt" && return 0; sleep 0.1; done; fail "never saw '$1'"; }
skip() { echo "SKIPPED: $*"; exit 77; }
# A study ends with 0, 1, or 77 where it could not measure; what it prints is the message.
study() {
  "$@" >"$work/study.txt" 2>&1; status=$?
  cat "$work/study.txt"
  [ $status -eq 77 ] && exit 77
  [ $status -eq 0 ] || { rm "$work/study.txt"; fail "exit status $status, see above"; }
}
# clock_study WHOSE JUMP_S...: each on a rig of its own.
clock_study() {
  local library
  library=$(find /usr/lib /usr/local/lib -name libfaketimeMT.so.1 2>/dev/null | head -n 1)
  [ -n "$library" ] || skip "no libfaketime here (package faketime): no clock was set under real processes"
  study "$bin/clock_study" "$bin" "$work/demo.toml" "$work/out" "$library" "$@"
}
# load_study SEED LOAD...
load_study() {
  command -v stress-ng >/dev/null || skip "no stress-ng here (package stress-ng): nothing was tested under load"
  study "$bin/load_study" "$bin" "$work/demo.toml" "$work/out" "$@"
}

case $case in
  arrives)
    "${demo[@]}" >"$work/demo.txt" 2>&1 || fail "exit status $?"
    cat "$work/demo.txt"
    [ -s "$work/out/insertion.lcm" ] && grep -q "</html>" "$work/out/report.html" || fail "no log or no report"
    ! grep -qE 'src="http|href="http' "$work/out/report.html" || fail "the report needs a network"
    ;;
  interrupted)
    "${demo[@]}" >"$work/demo.txt" 2>&1 & pid=$!
    wait_for steering
    sleep 1
    kill -INT $pid
    wait $pid; status=$?
    [ $status -eq 130 ] || fail "exit status $status, wanted 130"
    ;;
  process_dies)
    "${demo[@]}" >"$work/demo.txt" 2>&1 & pid=$!
    wait_for steering
    sleep 1
    kill -KILL "$(pgrep -f "bevel-camera --config $work/demo.toml")"
    wait $pid; status=$?
    [ $status -eq 1 ] || fail "exit status $status, wanted 1"
    grep -q "bevel-camera: killed by" "$work/demo.txt" || fail "does not say who died"
    ;;
  second_controller)
    "$bin/bevel-controller" --config "$work/demo.toml" >"$work/first.txt" 2>&1 & pid=$!
    sleep 0.5
    "$bin/bevel-controller" --config "$work/demo.toml" >"$work/second.txt" 2>&1 && fail "a second controller ran"
    grep -q "another bevel-controller" "$work/second.txt" || fail "does not say why"
    kill $pid; wait $pid || fail "the first ended with status $?"
    ;;
  second_camera)
    "${demo[@]}" >"$work/demo.txt" 2>&1 & pid=$!
    wait_for steering
    "$bin/bevel-camera" --config "$work/demo.toml" >"$work/second.txt" 2>&1 && fail "a second camera ran"
    grep -q "another bevel-camera" "$work/second.txt" || fail "does not say why"
    wait $pid || fail "the insertion ended with status $?"
    ;;
  second_operator)  # the client of docs/operator.md
    sed -n '/^```python/,/^```/p' "$source/docs/operator.md" | grep -v '^```' >"$work/client.py"
    export PYTHONPATH=$bin/../lcmtypes/python:$source/.deps/lcm
    python3 -c 'import bevel, lcm' 2>/dev/null || skip "no Python binding of LCM here"
    python3 "$work/client.py" >"$work/client.txt" 2>&1 & client=$!
    sleep 0.5
    "${demo[@]}" >"$work/demo.txt" 2>&1; status=$?
    kill $client 2>/dev/null || fail "the client ended by itself"
    wait $client 2>/dev/null
    [ $status -eq 1 ] || fail "exit status $status, wanted 1"
    grep -q "another operator program sends OPERATOR_HEARTBEAT" "$work/demo.txt" || fail "does not report why"
    ;;
  parent_killed)  # nobody is left to say stop; the children hear of it
    "${demo[@]}" >"$work/demo.txt" 2>&1 & pid=$!
    wait_for steering
    sleep 1
    kill -KILL $pid
    wait $pid 2>/dev/null
    for _ in $(seq 30); do [ -z "$(left_over)" ] && break; sleep 0.1; done
    "$bin/bevel-export" "$work/out/insertion.lcm" --out "$work/csv" >/dev/null 2>&1
    ;;
  stepper_terminated)
    "${demo[@]}" >"$work/demo.txt" 2>&1 & pid=$!
    wait_for steering
    sleep 1
    kill -TERM "$(pgrep -f "bevel-stepper --config $work/demo.toml")"
    wait $pid; status=$?
    [ $status -eq 1 ] || fail "exit status $status, wanted 1"
    grep -q "told to end" "$work/demo.txt" || fail "the operator does not hear why"
    # Its last words: told to end, at rest.
    "$bin/bevel-export" "$work/out/insertion.lcm" --out "$work/csv" >"$work/export.txt" 2>&1 || fail "export: $?"
    tail -n 1 "$work/csv/insertion/actuator_state.csv" | awk -F, '{exit !($6 < 0.05 && $6 > -0.05 && $8 < 0.05 && $8 > -0.05)}' ||
      fail "ended while moving: $(tail -n 1 "$work/csv/insertion/actuator_state.csv")"
    grep -aq "told to end" "$work/out/insertion.lcm" || fail "it does not say why it stopped"
    ;;
  full_disk)
    mkdir -p "$work/out"
    ln -s /dev/full "$work/out/insertion.lcm"
    "${demo[@]}" >"$work/demo.txt" 2>&1; status=$?
    [ $status -eq 1 ] || fail "exit status $status, wanted 1"
    grep -q "insertion.lcm" "$work/demo.txt" || fail "does not name the file"
    ;;
  log_at_limit)  # in flight: the write fails, and the needle is stopped
    (ulimit -f 1200; exec "${demo[@]}") >"$work/demo.txt" 2>&1; status=$?
    [ $status -eq 1 ] || fail "exit status $status, wanted 1"
    grep -q "controller steering" "$work/demo.txt" || fail "the limit was reached before it steered"
    grep -q "stopped because nothing is recorded" "$work/demo.txt" || fail "does not report why"
    ;;
  log_blocks)  # in flight: bevel-demo hangs in a write, as on a disk that does not answer
    logger=$(command -v lcm-logger || echo "$source/.deps/lcm/bin/lcm-logger")
    [ -x "$logger" ] || skip "no lcm-logger here"
    mkdir -p "$work/out"
    mkfifo "$work/out/insertion.lcm"
    (head -c 1200000 >/dev/null; exec sleep 60) <"$work/out/insertion.lcm" & reader=$!
    "$logger" --quiet "$work/second.lcm" 2>/dev/null & second=$!
    "${demo[@]}" >"$work/demo.txt" 2>&1 & pid=$!
    wait_for steering
    for _ in $(seq 150); do grep -aq "operator program does not respond" "$work/second.lcm" && break; sleep 0.1; done
    kill $second; wait $second
    grep -aq "operator program does not respond" "$work/second.lcm" || fail "the needle was not stopped"
    kill $reader; wait $reader 2>/dev/null
    wait $pid; status=$?
    [ $status -eq 1 ] || fail "exit status $status, wanted 1"
    ;;
  operator_stopped | operator_hung)  # TRIALS SEED: bevel-demo under SIGSTOP in flight
    "$bin/kill_study" "$bin" "$work/demo.toml" "$work/out" "unix:$work/s-can.sock" "${4:-2}" "${5:-1}" bevel-demo STOP ||
      fail "see above"
    ;;
  fault)
    "${demo[@]}" --fault camera:off@5s >"$work/demo.txt" 2>&1; status=$?
    cat "$work/demo.txt"
    [ $status -eq 1 ] || fail "exit status $status, wanted 1"
    grep -qE "measurements stale|a camera fell silent" "$work/demo.txt" || fail "does not say why"
    "${demo[@]}" --fault camera:off >"$work/demo.txt" 2>&1 && fail "a fault without a time was taken"
    grep -q "camera:off@5s" "$work/demo.txt" || fail "does not say how a fault is given"
    ;;
  out_of_reach)  # an answer, not something to wait for
    "${demo[@]}" --target=60,0,60 --time-limit 30 >"$work/demo.txt" 2>&1; status=$?
    [ $status -eq 1 ] || fail "exit status $status, wanted 1"
    grep -q "stopped: .*target out of reach" "$work/demo.txt" || fail "does not say that it is out of reach"
    ;;
  kills)
    "$bin/kill_study" "$bin" "$work/demo.toml" "$work/out" "unix:$work/s-can.sock" "${4:-3}" "${5:-1}" || fail "see above"
    ;;
  clock_set)  # of the machine on which everything runs
    clock_study all 3600 -3600 -0.2
    ;;
  clock_apart)  # of one machine of several
    clock_study camera -0.2
    clock_study controller 3600
    ;;
  clocks)
    for whose in all camera estimator controller stepper; do clock_study "$whose" 3600 -3600 -0.2; done
    ;;
  load)
    load_study 1 switch:4:19 mixed:2:19
    ;;
  command_latency)  # SAMPLES
    sed -i 's/^\[system\]/&\nrealtime = true/' "$work/demo.toml"
    "$bin/bevel-rig" --config "$work/demo.toml" >"$work/rig.txt" 2>&1 & rig=$!
    "$bin/bevel-stepper" --config "$work/demo.toml" >"$work/stepper.txt" 2>&1 & stepper=$!
    "$bin/command_latency" "$work/demo.toml" "${4:-200}" >"$work/latency.txt" 2>&1; status=$?
    kill $stepper $rig; wait $stepper $rig
    cat "$work/latency.txt"
    [ $status -eq 0 ] || fail "exit status $status"
    grep -q "^ratio at p50" "$work/latency.txt" || fail "no ratio"
    ;;
  realtime)  # every thread of controller and stepper, that on which LCM receives too, and their memory
    chrt -f 40 true 2>/dev/null || skip "no SCHED_FIFO here (needs CAP_SYS_NICE or RLIMIT_RTPRIO)"
    sed -i 's/^\[system\]/&\nrealtime = true/' "$work/demo.toml"
    "$bin/bevel-controller" --config "$work/demo.toml" >"$work/controller.txt" 2>&1 & controller=$!
    "$bin/bevel-stepper" --config "$work/demo.toml" >"$work/stepper.txt" 2>&1 & stepper=$!
    sleep 2
    threads=$(ps -T -o cls=,rtprio=,comm= -p $controller,$stepper)
    locked=$(grep -h VmLck /proc/$controller/status /proc/$stepper/status)
    kill $controller $stepper; wait $controller $stepper
    echo "$threads"; echo "$locked"
    [ "$(echo "$threads" | grep -c 'FF *40 bevel-control')" -ge 2 ] || fail "bevel-controller's threads, LCM's too, are not at 40"
    [ "$(echo "$threads" | grep -c 'FF *50 bevel-stepper')" -ge 2 ] || fail "bevel-stepper's threads, LCM's too, are not at 50"
    ! echo "$threads" | grep -qv FF || fail "a thread without SCHED_FIFO"
    ! echo "$locked" | grep -q ' 0 kB' || fail "memory is not locked"
    ;;
  loads)  # ROUNDS SEED
    for round in $(seq "${4:-1}"); do
      load_study $((${5:-1} + round)) switch:4:19 matrix:4:19 vm:1:19 mixed:2:19 mixed:4:10
    done
    ;;
  *) fail "no case '$case'" ;;
esac
[ -z "$(left_over)" ] || fail "still running: $(left_over)"
echo "ok: $case"
