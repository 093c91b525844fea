# SPDX-License-Identifier: MIT
"""Two drives by python-canopen under bevel-stepper, commanded over LCM as bevel-controller would: a whole insertion, and what
stops one. Nothing of the project but bevel-stepper runs.

    tests/peers/canopen_test.sh build/bin . canopen_drives
"""
import math
import signal
import threading
import time
import unittest

import canopen_support as support

support.need("canopen", "can", "lcm", "bevel")

import bevel
import canopen
import lcm
from cia402_drive import ENABLED, QUICK_STOP, READY, Drive
from local_can import LocalHub

COUNTS_PER_MM = 2000.0
COUNTS_PER_RAD = 51200 / (2 * math.pi)
# Not in a guest, whose time has no room for their transfers beside the PDOs that are watched.
LIMITS = "" if support.INTERFACE else """
[stepper.insertion]
drive_position_min_unit = -2.5
drive_position_max_unit = 150.0
"""
REST_COUNTS_S = 20.0
STOP, ARM = 0, 1  # the operator's words


def utime():
    return int(time.time() * 1e6)


class Controller:
    """MOTION_COMMAND at 50 Hz, and what the stepper says."""

    def __init__(self):
        self.rates = (0.0, 0.0)  # mm/s, rad/s
        self.mode = 1
        self.status = bevel.process_status_t()
        self.axes = bevel.actuator_state_t()
        self.heard = 0
        self._words = 0
        self._ended = threading.Event()
        self._ears = lcm.LCM()
        self._mouth = lcm.LCM()
        self._ears.subscribe("PROCESS_STATUS", self._on_status)
        self._ears.subscribe("ACTUATOR_STATE", self._on_axes)
        self._threads = [threading.Thread(target=run, daemon=True) for run in (self._hear, self._command)]
        for thread in self._threads:
            thread.start()

    def _on_status(self, channel, data):
        status = bevel.process_status_t.decode(data)
        if status.process == "bevel-stepper":
            self.status = status

    def _on_axes(self, channel, data):
        self.axes = bevel.actuator_state_t.decode(data)
        self.heard += 1

    def _hear(self):
        while not self._ended.is_set():
            self._ears.handle_timeout(50)

    def _command(self):
        seq, due = 0, time.monotonic()
        while not self._ended.is_set():
            command = bevel.motion_command_t()
            command.utime, command.seq, command.mode = utime(), seq, self.mode
            command.insertion_rate_mm_s, command.rotation_rate_rad_s = self.rates
            self._mouth.publish("MOTION_COMMAND", command.encode())
            seq, due = seq + 1, max(due + 0.02, time.monotonic())
            time.sleep(max(due - time.monotonic(), 0))

    def say(self, word):
        m = bevel.steering_target_t()
        m.utime, m.seq, m.request = utime(), self._words, word
        m.session = [0, self.status.session, 0]
        self._words += 1
        self._mouth.publish("STEERING_TARGET", m.encode())

    def said(self):
        return f"bevel-stepper says {self.status.state}: {self.status.reason}"

    def close(self):
        self._ended.set()
        for thread in self._threads:
            thread.join()


class Rig(unittest.TestCase):
    exit_status = 0  # of bevel-stepper: 1 if it ends before both axes are measured at rest

    def setUp(self):
        if not support.INTERFACE:
            hub = LocalHub(support.PATH)
            self.addCleanup(hub.close)
        self.drives = []
        for node in (1, 2):
            drive = Drive(support.open_bus(), node)
            self.addCleanup(drive.close)
            self.drives.append(drive)
        self.stepper = support.start("bevel-stepper", "--config", support.system_file("stepper.toml", more=LIMITS))
        self.addCleanup(self.end_stepper)
        self.controller = Controller()
        self.addCleanup(self.controller.close)
        self.reach("ready")

    def end_stepper(self):
        self.stepper.send_signal(signal.SIGCONT)
        self.assertEqual(support.end(self.stepper), self.exit_status)

    def reach(self, state, longest_s=6):
        support.wait_until(lambda: self.controller.status.state == state, longest_s,
                           lambda: f"state {state}; {self.controller.said()}")

    def reach_reason(self, text, longest_s=2):
        support.wait_until(lambda: text in self.controller.status.reason, longest_s,
                           lambda: f"'{text}'; {self.controller.said()}")

    def arm(self):
        self.controller.rates = (0.0, 0.0)
        self.controller.say(ARM)
        self.reach("enabled")
        self.assertEqual([drive.state for drive in self.drives], [ENABLED, ENABLED])

    def insert(self, rates=(10.0, 2.0), for_s=0.5):
        self.controller.rates = rates
        time.sleep(for_s)
        wanted = rates[0] * COUNTS_PER_MM, rates[1] * COUNTS_PER_RAD
        for drive, velocity in zip(self.drives, wanted):
            self.assertAlmostEqual(drive.velocity, velocity, delta=1, msg=self.controller.said())

    def ms_to_rest(self, since, drives=None):
        drives = self.drives if drives is None else drives
        support.wait_until(lambda: all(abs(d.velocity) < REST_COUNTS_S for d in drives), 2, "rest")
        return 1000 * max(min(t for t, v in d.log if t > since and abs(v) < REST_COUNTS_S) - since for d in drives)


class Insertion(Rig):
    def test_a_whole_insertion(self):
        insertion, rotation = self.drives
        self.assertEqual((insertion.state, rotation.state), (READY, READY))
        for drive in self.drives:
            self.assertEqual(drive.value(0x1016, 1) >> 16, 127)
            self.assertLessEqual(drive.value(0x1016, 1) & 0xFFFF, 120)
        self.assertEqual([d.value(0x6007) for d in self.drives], [3, 3])
        if LIMITS:
            self.assertEqual([insertion.value(0x607D, sub) for sub in (1, 2)], [-5000, 300000])
        self.controller.rates = (5.0, 1.0)
        time.sleep(0.2)
        self.assertEqual((insertion.position, rotation.position), (0.0, 0.0), "moved before it was armed")
        self.arm()
        self.insert((10.0, 2.0), 1.5)
        self.insert((10.0, -3.0), 1.0)
        self.controller.rates = (0.0, 0.0)
        support.wait_until(lambda: all(d.velocity == 0 for d in self.drives), 1, "rest")
        time.sleep(0.1)
        axes = self.controller.axes
        self.assertEqual(list(axes.axis_status), [2, 2])
        self.assertAlmostEqual(axes.insertion_mm, insertion.position / COUNTS_PER_MM, delta=0.001)
        self.assertAlmostEqual(axes.rotation_rad, rotation.position / COUNTS_PER_RAD, delta=0.001)
        self.assertAlmostEqual(axes.insertion_mm, 25.0, delta=1.0)
        deepest_mm = axes.insertion_mm
        self.insert((-10.0, 0.0), 0.6)  # back out
        since = time.monotonic()
        self.controller.say(STOP)
        took_ms = self.ms_to_rest(since)
        self.reach("stopped", 1)
        self.assertLessEqual(took_ms, 100 * support.PATIENCE)
        self.assertEqual([d.state for d in self.drives], [QUICK_STOP] * 2)
        self.assertIn("operator", self.controller.status.reason)
        self.assertGreater(self.controller.heard, 100)
        print(f"python-canopen: {deepest_mm:.2f} mm deep, at rest {took_ms:.0f} ms after the operator's stop")


class Faults(Rig):
    def test_a_fault(self):
        """Of one drive: stops the other one, until both are armed again."""
        self.arm()
        self.insert()
        insertion, rotation = self.drives
        since = time.monotonic()
        rotation.fault(0x2310)
        self.assertLessEqual(self.ms_to_rest(since), 100 * support.PATIENCE)
        self.reach("fault", 1)
        self.assertIn("0x2310", self.controller.status.reason)
        self.assertEqual(insertion.state, QUICK_STOP)
        time.sleep(0.3)
        self.assertEqual(self.controller.status.state, "fault")
        self.arm()
        self.insert()

    def test_a_limit_switch(self):
        """Of one drive: it holds, the driver asks it which (60FD) and stops both."""
        self.arm()
        self.insert()
        since = time.monotonic()
        self.drives[0].switch_at = self.drives[0].position
        self.assertLessEqual(self.ms_to_rest(since), 200 * support.PATIENCE)
        self.reach("stopped", 1)
        end = time.monotonic() + 1
        while "upper limit switch" not in self.controller.status.reason and time.monotonic() < end:
            time.sleep(0.02)
        self.assertIn("insertion: axis is at its upper limit switch", self.controller.status.reason)

    def test_an_unplugged(self):
        """Drive stops, and so does the other."""
        self.arm()
        self.insert()
        since = time.monotonic()
        self.exit_status = 1
        self.drives[0].unplug()
        took_ms = self.ms_to_rest(since)
        self.assertLessEqual(took_ms, 200 * support.PATIENCE)
        self.reach("stopped", 1)
        print(f"python-canopen: both rest {took_ms:.0f} ms after one was unplugged ({self.controller.status.reason})")

    def test_a_stop_that_is_not_carried_out(self):
        """Quick-stop deceleration of 1 count/s^2: the drive acknowledges the stop and goes on."""
        self.arm()
        self.insert()
        with self.drives[0]._lock:
            self.drives[0].set_object(0x6085, 1)
        since = time.monotonic()
        self.controller.say(STOP)
        took_ms = self.ms_to_rest(since)
        self.assertLessEqual(took_ms, 150 * support.PATIENCE)
        self.reach("fault", 1)
        self.reach_reason("insertion DID NOT SLOW by its quick stop")
        self.assertIn("stopped by the operator", self.controller.status.reason)
        print(f"python-canopen: both rest {took_ms:.0f} ms after a stop whose ramp is missing")

    def test_a_foreign_write(self):
        """Another node sets 0x6085 = 1 by SDO while the axes move."""
        self.arm()
        self.insert()
        since = time.monotonic()
        self.drives[1].network.send_message(0x601, bytes([0x23, 0x85, 0x60, 0, 1, 0, 0, 0]))
        took_ms = self.ms_to_rest(since)
        self.assertLessEqual(took_ms, 200 * support.PATIENCE)
        self.reach("fault", 1)
        self.assertIn("another master commands the drives", self.controller.status.reason)

    def test_a_setting_that_changes(self):
        """Without a frame on the bus: found by the cyclic read-back."""
        self.arm()
        self.insert()
        with self.drives[0]._lock:
            self.drives[0].set_object(0x6085, 1)
        self.reach("fault", 4)
        self.assertIn("0x6085:00 is 1, required 1000000", self.controller.status.reason)
        self.reach_reason("insertion DID NOT SLOW by its quick stop")
        self.assertLess(abs(self.drives[0].velocity), REST_COUNTS_S)

    def test_a_stopped_stepper(self):
        """By SIGSTOP: the drives stop by their own watch, and what it says when it goes on moves nothing."""
        self.arm()
        self.insert()
        since = time.monotonic()
        self.stepper.send_signal(signal.SIGSTOP)
        took_ms = self.ms_to_rest(since)
        self.assertLessEqual(took_ms, 200 * support.PATIENCE)
        positions = [d.position for d in self.drives]
        self.stepper.send_signal(signal.SIGCONT)
        time.sleep(0.5)
        self.assertEqual([d.position for d in self.drives], positions, "an old command moved an axis")
        self.assertIn(self.controller.status.state, ("stopped", "fault"))
        print(f"python-canopen: both rest {took_ms:.0f} ms after a SIGSTOP of bevel-stepper")


if __name__ == "__main__":
    import can
    print(f"python-canopen {canopen.__version__}, python-can {can.__version__}, bus {support.ADDRESS}")
    unittest.main(verbosity=2)
