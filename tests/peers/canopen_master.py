# SPDX-License-Identifier: MIT
"""python-canopen, a master that shares no code with the project, against the drives of bevel-rig.

    tests/peers/canopen_test.sh build/bin . canopen_master
"""
import logging
import struct
import threading
import time
import unittest

import canopen_support as support

support.need("canopen", "can")

import canopen
from canopen.profiles.p402 import BaseNode402

logging.disable(logging.WARNING)  # that it reads by SDO what no TPDO carries
canopen.sdo.SdoClient.RESPONSE_TIMEOUT = 1.0
NODE = 1
MASTER = 127


class Master(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.rig = support.start("bevel-rig", "--config", support.system_file("rig.toml"), "--lcm-url", "memq://")
        cls.network = support.open_network(support.open_bus())
        cls.network.check()

    @classmethod
    def tearDownClass(cls):
        cls.network.disconnect()
        status = support.end(cls.rig)
        assert status == 0, f"bevel-rig ended with status {status}"

    def setUp(self):
        """The drive as it leaves the factory, and a master that knows nothing of it but its EDS."""
        self.node = BaseNode402(NODE, support.EDS)
        self.network.add_node(self.node)
        booted = threading.Event()
        on_boot = lambda can_id, data, timestamp: booted.set() if data[0] == 0 else None
        self.network.subscribe(0x700 + NODE, on_boot)
        for _ in range(20):  # a rig that has just been started may not hear the first
            self.node.nmt.state = "RESET"
            if booted.wait(0.25):
                break
        self.network.unsubscribe(0x700 + NODE, on_boot)
        self.assertTrue(booted.is_set(), "no boot-up after a reset")

    def sdo(self, index, sub=None):
        return self.node.sdo[index] if sub is None else self.node.sdo[index][sub]

    def aborts_with(self, code, action):
        with self.assertRaises(canopen.SdoAbortedError) as raised:
            action()
        self.assertEqual(raised.exception.code, code)

    def test_nmt_states_and_heartbeat(self):
        self.sdo(0x1017).raw = 20
        for state in ("PRE-OPERATIONAL", "OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"):
            self.node.nmt.state = state
            time.sleep(0.03)
            self.assertEqual(self.node.nmt.wait_for_heartbeat(1), state)
        count, begun = [0], time.monotonic()

        def counted(*_):
            count[0] += 1
        self.network.subscribe(0x700 + NODE, counted)
        time.sleep(1.0)
        self.network.unsubscribe(0x700 + NODE, counted)
        self.assertAlmostEqual(count[0] / (time.monotonic() - begun), 50, delta=8)

    def test_identity_and_texts(self):
        identity = [self.sdo(0x1018, sub).raw for sub in range(1, 5)]
        self.assertEqual(identity, [0xBEE, 402, 1, 1])
        self.assertEqual(self.sdo(0x1000).raw & 0xFFFF, 402)
        self.assertEqual(self.sdo(0x1008).raw, "Bevel simulated stepper drive")  # in segments
        self.assertEqual(self.sdo(0x1009).raw, "simulated")
        self.assertEqual(self.sdo(0x100A).raw, "2.0")  # expedited

    def test_every_object_of_the_eds(self):
        asked = 0
        for entry in self.node.object_dictionary.values():
            variables = [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else list(entry.values())
            for variable in variables:
                with self.subTest(object=f"{variable.index:04X}:{variable.subindex:X} {variable.name}"):
                    data = self.node.sdo.upload(variable.index, variable.subindex)
                    if variable.index == 0x6041:  # says of itself what the drive is at
                        continue
                    self.assertEqual(variable.decode_raw(data), variable.default)
                    if variable.writable:
                        self.node.sdo.download(variable.index, variable.subindex, data)
                asked += 1
        self.assertGreater(asked, 150)

    def test_downloads_and_aborts(self):
        self.sdo(0x6083).raw = 123456
        self.assertEqual(self.sdo(0x6083).raw, 123456)
        self.sdo(0x607D, 1).raw = -77
        self.assertEqual(self.sdo(0x607D, 1).raw, -77)
        upload, download = self.node.sdo.upload, self.node.sdo.download
        self.aborts_with(0x06020000, lambda: upload(0x5FFF, 0))
        self.aborts_with(0x06090011, lambda: upload(0x1018, 9))
        self.aborts_with(0x06010002, lambda: download(0x6041, 0, b"\0\0"))
        self.aborts_with(0x06070012, lambda: download(0x6040, 0, b"\0\0\0\0"))
        self.aborts_with(0x06070013, lambda: download(0x60FF, 0, b"\0"))
        self.aborts_with(0x06090030, lambda: download(0x605A, 0, struct.pack("<h", 3)))
        # Nothing here is longer than four bytes; a download in segments or blocks is refused, and the next one works.
        self.aborts_with(0x05040001, lambda: download(0x6083, 0, b"far too long for it"))
        self.assertEqual(self.sdo(0x6083).raw, 123456)

    def map_pdos(self, rpdo_type=255, tpdo_type=1):
        node = self.node
        node.nmt.state = "PRE-OPERATIONAL"
        node.tpdo.read()
        node.rpdo.read()
        for pdo, names, kind in ((node.rpdo[1], (0x6040, 0x60FF), rpdo_type), (node.tpdo[1], (0x6041, 0x606C), tpdo_type),
                                 (node.tpdo[2], (0x6064, 0x6061), tpdo_type)):
            pdo.clear()
            for index in names:
                pdo.add_variable(index)
            pdo.trans_type = kind
            pdo.enabled = True
            pdo.save()
        self.addCleanup(node.nmt.__setattr__, "state", "RESET")

    def test_pdo_mapping_is_read_back_and_used(self):
        self.map_pdos()
        other = canopen.RemoteNode(NODE, support.EDS)  # knows nothing of what was saved
        self.network.add_node(other)
        other.tpdo.read()
        other.rpdo.read()
        mapped = [[(v.index, v.subindex, v.length) for v in pdo.map] for pdo in (other.rpdo[1], other.tpdo[1], other.tpdo[2])]
        self.network.add_node(self.node)
        self.assertEqual(mapped, [[(0x6040, 0, 16), (0x60FF, 0, 32)], [(0x6041, 0, 16), (0x606C, 0, 32)],
                                  [(0x6064, 0, 32), (0x6061, 0, 8)]])
        self.assertTrue(other.tpdo[1].enabled and not other.tpdo[3].enabled)
        self.node.tpdo.subscribe()
        self.node.nmt.state = "OPERATIONAL"
        self.network.sync.transmit()
        self.assertIsNotNone(self.node.tpdo[1].wait_for_reception(1), "no TPDO after a SYNC")
        self.assertEqual(self.node.tpdo[1][0x6041].raw & 0x6F, 0x40)
        # Mappings change in pre-operational alone.
        self.aborts_with(0x08000022, lambda: self.node.sdo.download(0x1A00, 0, b"\0"))

    def enable(self, mode="PROFILED VELOCITY"):
        self.node.setup_402_state_machine(read_pdos=False)
        self.node.op_mode = mode
        self.assertEqual(self.node.op_mode, mode)
        self.node.state = "OPERATION ENABLED"
        self.assertEqual(self.node.state, "OPERATION ENABLED")

    def velocity(self):
        return self.sdo(0x606C).raw

    def run_at(self, velocity):
        self.sdo(0x6083).raw = self.sdo(0x6084).raw = 40000
        self.sdo(0x60FF).raw = velocity
        support.wait_until(lambda: abs(self.velocity() - velocity) <= abs(velocity) / 1000, 2, f"a velocity of {velocity}")

    def test_profile_velocity(self):
        self.enable()
        self.run_at(4000)

        def position():  # read at some time between the two
            before = time.monotonic()
            value = self.sdo(0x6064).raw
            return before, value, time.monotonic()

        before, first, after = position()
        worst = max(abs(self.velocity() - 4000) for _ in range(200))
        later_before, last, later_after = position()
        self.assertLessEqual(worst, 4, "606C: a per mille of 4000")
        self.assertGreaterEqual(last - first, 3900 * (later_before - after))
        self.assertLessEqual(last - first, 4100 * (later_after - before))
        self.assertTrue(self.node.statusword & 0x400, "target reached")
        self.run_at(-2000)
        self.sdo(0x6040).raw = 0x10F  # halt
        support.wait_until(lambda: self.velocity() == 0, 1, "a halt")
        print(f"python-canopen: 606C within {worst} of 4000 in 200 readings")

    def test_states_forth_and_back(self):
        self.enable()
        for state in ("SWITCHED ON", "OPERATION ENABLED", "READY TO SWITCH ON", "SWITCH ON DISABLED", "OPERATION ENABLED"):
            self.node.state = state
            self.assertEqual(self.node.state, state)

    def test_quick_stop(self):
        for option, state in ((6, "QUICK STOP ACTIVE"), (2, "SWITCH ON DISABLED")):
            with self.subTest(option=option):
                self.sdo(0x605A).raw = option
                self.enable()
                self.run_at(4000)
                self.node.controlword = 0x02
                support.wait_until(lambda: self.velocity() == 0, 0.5, "rest")
                self.assertEqual(self.node.state, state)
                self.node.state = "SWITCH ON DISABLED"

    def test_fault_and_its_reset(self):
        self.sdo(0x6065).raw, self.sdo(0x6066).raw = 5, 0  # less than any motor lags
        self.enable()
        self.sdo(0x60FF).raw = 4000
        support.wait_until(self.node.is_faulted, 2, "a following error")
        self.assertEqual(self.sdo(0x603F).raw, 0x8611)
        self.assertEqual([e.code for e in self.node.emcy.log], [0x8611])
        self.assertTrue(self.sdo(0x1001).raw & 1)
        self.sdo(0x6065).raw = 2000
        self.sdo(0x60FF).raw = 0
        self.node.reset_from_fault()
        self.assertEqual(self.node.state, "OPERATION ENABLED")
        self.assertEqual(self.node.emcy.log[-1].code, 0)
        self.assertEqual(self.sdo(0x603F).raw, 0)

    def test_homing(self):
        self.enable()
        self.run_at(4000)
        self.run_at(0)
        support.wait_until(lambda: self.velocity() == 0, 1, "rest")
        self.assertGreater(self.sdo(0x6064).raw, 200)
        self.sdo(0x607C).raw = -300  # zero lies 300 below home
        self.assertTrue(self.node.homing(timeout=2))
        self.assertEqual(self.sdo(0x6064).raw, 300)
        self.assertTrue(self.node.is_homed())

    def test_software_limit(self):
        self.sdo(0x607D, 2).raw = 1000
        self.enable()
        self.sdo(0x60FF).raw = 8000
        support.wait_until(lambda: self.node.statusword & 0x800, 2, "internal limit active")
        support.wait_until(lambda: self.velocity() == 0, 1, "rest")
        self.assertAlmostEqual(self.sdo(0x6064).raw, 1000, delta=2)

    def test_cyclic_velocity_by_sync(self):
        self.map_pdos(rpdo_type=1)
        self.node.nmt.state = "OPERATIONAL"
        self.network.sync.start(0.01)
        self.addCleanup(self.network.sync.stop)
        command = self.node.rpdo[1]
        command.start(0.01)
        self.addCleanup(command.stop)
        self.enable("CYCLIC SYNCHRONOUS VELOCITY")
        command[0x60FF].raw = 3000
        command.update()
        support.wait_until(lambda: abs(self.node.tpdo[1][0x606C].raw - 3000) <= 3, 2, "606C in the TPDO")
        self.assertTrue(self.node.statusword & 0x1000, "follows")

    def test_heartbeat_watch_while_pdos_go_on(self):
        self.sdo(0x1016, 1).raw = MASTER << 16 | 100 * support.PATIENCE
        self.sdo(0x6007).raw = 3
        self.sdo(0x1029, 1).raw = 0
        self.map_pdos()
        self.node.nmt.state = "OPERATIONAL"
        self.network.sync.start(0.01)
        self.addCleanup(self.network.sync.stop)
        heartbeat = self.network.send_periodic(0x700 + MASTER, [5], 0.03)
        self.addCleanup(heartbeat.stop)
        self.enable()
        self.run_at(20000)
        command = self.node.rpdo[1]
        command[0x6040].raw, command[0x60FF].raw = 0x0F, 20000
        command.start(0.01)
        self.addCleanup(command.stop)
        time.sleep(0.2)
        heartbeat.stop()
        silent_since = time.monotonic()
        position = self.sdo(0x6064).raw
        support.wait_until(lambda: self.velocity() == 0, 2, "rest")
        took_ms = 1000 * (time.monotonic() - silent_since)
        self.assertLessEqual(took_ms, 200 * support.PATIENCE)
        self.assertGreater(self.sdo(0x6064).raw, position)
        print(f"python-canopen: rest {took_ms:.0f} ms after the last heartbeat, PDOs going on")


if __name__ == "__main__":
    import can
    print(f"python-canopen {canopen.__version__}, python-can {can.__version__}, bus {support.ADDRESS}")
    unittest.main(verbosity=2)
