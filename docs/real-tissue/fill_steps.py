#!/usr/bin/env python3
"""Stepwise logs for bevel-diagnose: ACTUATOR_STATE every 50 ms between the steps, at constant speed. Nobody recorded
how the base moved within a step, so this is an assumption: harmless for what depends on depth alone, and the reason why
effects of time, speed and rest must not be read from such logs.

    fill_steps.py [--step-s 2] [--duty SHARE] [--cycle-mm 1] OUT_FOLDER LOG...

With --step-s every step takes that long, whatever the clock said: a hand's pauses are then no covariate.
With --duty the shaft makes a whole turn in the last SHARE of each cycle of insertion: duty-cycled rotation, of which
only the share is known, not the pattern.
"""
import argparse
import math
import pathlib
import struct
import sys

SYNC = 0xEDA1DA01
PERIOD_US = 50_000
STATE = struct.Struct(">8sqqii4d")  # fingerprint, then actuator_state_t


def events(path):
    data, at = path.read_bytes(), 0
    while at < len(data):
        sync, _, utime, channel_size, size = struct.unpack_from(">Iqqii", data, at)
        if sync != SYNC:
            sys.exit(f"{path}: byte {at}: no LCM event; is it a log of bevel-import?")
        at += 28
        yield utime, data[at : at + channel_size], data[at + channel_size : at + channel_size + size]
        at += channel_size + size


def turned_rad(inserted_mm, duty, cycle_mm):
    cycles, rest = divmod(inserted_mm / cycle_mm, 1)
    return 2 * math.pi * (cycles + (max(0.0, rest - (1 - duty)) / duty if duty else 0.0)) if duty else 0.0


def state(fields, utime, position, rate):
    return STATE.pack(fields[0], utime, 0, fields[3], fields[4], position[0], rate[0], position[1], rate[1])


def between(before, after, duty, cycle_mm):
    """States from one to the next, both left out; the rate is what the two positions give."""
    a, b = STATE.unpack(before), STATE.unpack(after)
    speed_mm_s = (b[5] - a[5]) / (b[1] - a[1]) * 1e6
    last_rad = turned_rad(a[5], duty, cycle_mm)
    for utime in range(a[1] + PERIOD_US, b[1] - PERIOD_US // 2, PERIOD_US):
        inserted_mm = a[5] + speed_mm_s * (utime - a[1]) * 1e-6
        rad = turned_rad(inserted_mm, duty, cycle_mm)
        yield utime, state(a, utime, (inserted_mm, rad), (speed_mm_s, (rad - last_rad) / PERIOD_US * 1e6))
        last_rad = rad


def evenly(messages, step_s):
    """Times of the log replaced: the n-th different time becomes n steps."""
    first, times = None, {}
    for utime, channel, message in messages:
        first = utime if first is None else first
        number = times.setdefault(utime, len(times))
        utime = first + round(number * step_s * 1e6)
        yield utime, channel, message[:8] + struct.pack(">q", utime) + message[16:]


def fill(source, target, duty, cycle_mm, step_s):
    written, last = [], None
    for utime, channel, message in evenly(events(source), step_s) if step_s else events(source):
        if channel == b"ACTUATOR_STATE":
            if last:
                written += [(u, channel, m) for u, m in between(last, message, duty, cycle_mm)]
            last = message
            known = STATE.unpack(message)
            turned = known[7] + turned_rad(known[5], duty, cycle_mm)
            message = state(known, utime, (known[5], turned), (known[6], known[8]))
        written.append((utime, channel, message))
    states = 0
    with target.open("wb") as out:
        for number, (utime, channel, message) in enumerate(written):
            if channel == b"ACTUATOR_STATE":
                message = message[:16] + struct.pack(">q", states) + message[24:]
                states += 1
            out.write(struct.pack(">Iqqii", SYNC, number, utime, len(channel), len(message)) + channel + message)


options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
options.add_argument("--step-s", type=float, default=0.0)
options.add_argument("--duty", type=float, default=0.0)
options.add_argument("--cycle-mm", type=float, default=1.0)
options.add_argument("out", type=pathlib.Path)
options.add_argument("log", type=pathlib.Path, nargs="+")
chosen = options.parse_args()
chosen.out.mkdir(parents=True, exist_ok=True)
for log in chosen.log:
    fill(log, chosen.out / log.name, chosen.duty, chosen.cycle_mm, chosen.step_s)
