# SPDX-License-Identifier: MIT
"""What the two tests with python-canopen share: skipping, the bus, programs of the project, waiting.

Settings come from the environment, which canopen_test.sh fills in: BEVEL_BIN (folder of the programs), BEVEL_SOURCE (folder
of the project), BEVEL_CAN (a CAN interface; unset: a local bus in a folder of the test's own).
"""
import importlib.util
import os
import signal
import subprocess
import sys
import tempfile
import time

SKIPPED = 77


def need(*packages):
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    if missing:
        print(f"SKIPPED: no {', '.join(missing)} for {sys.executable}; tools/setup installs python-canopen, python-can "
              "and LCM's Python into .deps")
        sys.exit(SKIPPED)


BIN = os.environ.get("BEVEL_BIN", "build/bin")
SOURCE = os.environ.get("BEVEL_SOURCE", ".")
INTERFACE = os.environ.get("BEVEL_CAN", "")
# A CAN interface may be that of a guest whose time goes by unevenly (tools/in-vm): there times are bounded, not judged.
PATIENCE = 10 if INTERFACE else 1
EDS = os.path.join(SOURCE, "rig/src/drives/bevel_drive.eds")
FOLDER = tempfile.TemporaryDirectory(prefix="bevel-peers-")
PATH = os.path.join(FOLDER.name, "can.sock")
ADDRESS = INTERFACE or f"unix:{PATH}"  # as system files and bevel-stepper --can have it


def open_bus():
    import can
    import local_can
    if INTERFACE:
        from can.interfaces.socketcan import SocketcanBus

        class Bus(SocketcanBus):
            # Heartbeats by a thread: not every kernel has the broadcast manager, to which SocketcanBus gives them.
            _send_periodic_internal = can.BusABC._send_periodic_internal
        return Bus(INTERFACE)
    wait_until(lambda: os.path.exists(PATH), 5, "the hub of the local bus")
    return local_can.LocalBus(PATH)


def open_network(bus):
    import canopen
    network = canopen.Network()
    network.bus = bus
    network.connect()
    return network


def system_file(name, can_address=None, more=""):
    """config/demo.toml with the bus and sockets of this test, and what more is wanted; its path."""
    with open(os.path.join(SOURCE, "config/demo.toml"), encoding="utf-8") as file:
        text = file.read()
    text = text.replace("unix:/tmp/bevel-demo-can.sock", can_address or ADDRESS)
    text = text.replace("/tmp/bevel-demo", os.path.join(FOLDER.name, "s"))
    if INTERFACE:  # the slowest that is still allowed
        text += ("\n[stepper]\nperiod_ms = 20\nmaster_heartbeat_ms = 40\nmaster_heartbeat_timeout_ms = 120\n"
                 "drive_heartbeat_ms = 40\ndrive_heartbeat_timeout_ms = 120\nsetpoint_zero_age_ms = 110\n"
                 "setpoint_stop_age_ms = 120\n")
    text += more
    path = os.path.join(FOLDER.name, name)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    return path


def start(program, *arguments):
    return subprocess.Popen([os.path.join(BIN, program), *arguments, "--end-with", str(os.getpid())])


def end(process):
    process.send_signal(signal.SIGTERM)
    return process.wait(5)


def wait_until(condition, longest_s, what):
    """The value of the condition once it is true. What: a text, or a function that makes it."""
    begun = time.monotonic()
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() - begun > longest_s * PATIENCE:
            raise AssertionError(f"not within {longest_s} s: {what() if callable(what) else what}")
        time.sleep(0.002)
