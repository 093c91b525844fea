# SPDX-License-Identifier: MIT
"""A CiA 402 drive made of python-canopen's LocalNode: SDO server, NMT slave, PDO maps and emergencies are the library's, the
power state machine, the motor and the watch over the master are written here from IEC 61800-7-201. It shares no code with the
project and knows of it only rig/src/drives/bevel_drive.eds.

Time passes when something happens, or 200 times a second: the motor is moved on to that instant.
"""
import struct
import threading
import time

import canopen
import canopen_support as support

# State: bits of the statusword under 0x6F.
SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x08
REMOTE, INTERNAL_LIMIT = 0x200, 0x800
MASTER = 127
RAMPS_DOWN = {6: QUICK_STOP, 2: SWITCH_ON_DISABLED}


class Drive:
    def __init__(self, bus, node_id):
        # A network of its own: what one drive sends the other one hears, as on a wire.
        heard = (0x000, 0x080, 0x200 + node_id, 0x600 + node_id, 0x700 + MASTER)
        bus.set_filters([{"can_id": i, "can_mask": 0x7FF} for i in heard])
        self.network = canopen.Network()
        self.network.bus = bus
        self.network.connect()
        self.id = node_id
        self.state = SWITCH_ON_DISABLED
        self.position = 0.0  # counts
        self.velocity = 0.0
        self.silent = False
        self.switch_at = None  # counts, of a limit switch in the positive direction
        self.log = []  # (monotonic s, velocity), for who measures
        self._lock = threading.RLock()
        self._moved = time.monotonic()
        self._master_heard = None
        self._reset_bit = False
        self._written = {}  # (index, sub): value, of what the master has set
        self._make_node()
        self.network.subscribe(0x000, self._on_nmt)
        self.network.subscribe(0x080, self._on_sync)
        self.network.subscribe(0x200 + node_id, self._on_rpdo)
        self.network.subscribe(0x700 + MASTER, self._on_master)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self.node.nmt.send_command(0)  # boot-up
        self.node.nmt.state = "PRE-OPERATIONAL"

    def _make_node(self):
        self.node = canopen.LocalNode(self.id, support.EDS)
        self.network.add_node(self.node)
        self.node.add_read_callback(self._on_read)
        self.node.add_write_callback(self._on_write)

    def close(self):
        self._ended.set()
        self._thread.join()
        self.node.nmt.stop_heartbeat()
        self.network.disconnect()

    # Objects ----------------------------------------------------------------------------------------------------------

    def value(self, index, sub=0):
        if (index, sub) not in self._written:
            entry = self.node.object_dictionary[index]
            self._written[index, sub] = (entry[sub] if sub else entry).default
        return self._written[index, sub]

    def set_object(self, index, value, sub=0):
        """As a defect of its memory would: no write callback, no frame."""
        self._written[index, sub] = value
        entry = self.node.object_dictionary[index]
        self.node.set_data(index, sub, (entry[sub] if sub else entry).encode_raw(value))

    def _live(self):
        at_switch = INTERNAL_LIMIT if self._at_switch() else 0
        return {0x6041: self.state | REMOTE | at_switch, 0x6064: round(self.position), 0x606C: round(self.velocity),
                0x6061: self.value(0x6060), 0x60FD: 2 if self._at_switch() else 0}

    def _at_switch(self):
        return self.switch_at is not None and self.position >= self.switch_at

    def _on_read(self, index, subindex, od):
        if index not in (0x6041, 0x6061, 0x6064, 0x606C, 0x60FD):
            return None  # stored
        with self._lock:
            self._move()
            return self._live()[index]

    def _on_write(self, index, subindex, od, data):
        with self._lock:
            self._move()
            self._written[index, subindex] = od.decode_raw(data)
            if index == 0x6040:
                self._on_controlword(struct.unpack("<H", data)[0])

    # Motion -----------------------------------------------------------------------------------------------------------

    def _move(self):
        now = time.monotonic()
        dt, self._moved = now - self._moved, now
        target, ramp = 0.0, self.value(0x6085)
        if self.state == ENABLED:
            target = self.value(0x60FF)
            ramp = self.value(0x6083 if abs(target) > abs(self.velocity) else 0x6084)
            if self._at_switch():
                target = min(target, 0.0)
        if self.state not in (ENABLED, QUICK_STOP, SWITCHED_ON):
            self.velocity = 0.0
        change = target - self.velocity
        ramp_s = min(dt, abs(change) / ramp)
        reached = self.velocity + (ramp if change > 0 else -ramp) * ramp_s
        self.position += (self.velocity + reached) / 2 * ramp_s + (target if ramp_s < dt else reached) * (dt - ramp_s)
        self.velocity = target if ramp_s < dt else reached
        self.log.append((now, self.velocity))
        if self.state == QUICK_STOP and self.velocity == 0.0:
            self.state = RAMPS_DOWN.get(self.value(0x605A), QUICK_STOP)

    # Power state machine ----------------------------------------------------------------------------------------------

    def _on_controlword(self, word):
        edge, self._reset_bit = bool(word & 0x80) and not self._reset_bit, bool(word & 0x80)
        if self.state == FAULT:
            if edge:
                self.state = SWITCH_ON_DISABLED
                self.node.emcy.reset()
            return
        if self._reset_bit:
            return
        if not word & 0x02:
            self.state = SWITCH_ON_DISABLED
        elif not word & 0x04:
            if self.state != QUICK_STOP:
                self.state = QUICK_STOP if self.state == ENABLED else SWITCH_ON_DISABLED
        else:
            step = {(SWITCH_ON_DISABLED, 0x06): READY, (READY, 0x07): SWITCHED_ON, (READY, 0x0F): SWITCHED_ON,
                    (SWITCHED_ON, 0x06): READY, (SWITCHED_ON, 0x0F): ENABLED, (ENABLED, 0x06): READY,
                    (ENABLED, 0x07): SWITCHED_ON}
            self.state = step.get((self.state, word & 0x0F), self.state)

    def fault(self, code):
        with self._lock:
            self._move()
            self.state = FAULT
            self.node.set_data(0x603F, 0, struct.pack("<H", code))
            self.node.emcy.send(code, 1)

    # Bus --------------------------------------------------------------------------------------------------------------

    def _on_nmt(self, can_id, data, timestamp):
        command, node = data
        if node not in (0, self.id) or self.silent:
            return
        with self._lock:
            if command in (0x81, 0x82):  # the library changes its state, and leaves the boot-up to the device
                self.node.nmt.stop_heartbeat()
                self._master_heard = None
                for index in [i for i in self.node.data_store if i < 0x2000]:
                    del self.node.data_store[index]
                self._written = {key: value for key, value in self._written.items() if key[0] >= 0x2000}
                self.node.nmt.send_command(0)
                self.node.nmt.state = "PRE-OPERATIONAL"
            elif command == 0x01:
                self.node.tpdo.read()
                self.node.rpdo.read()

    def _on_rpdo(self, can_id, data, timestamp):
        if self.silent or self.node.nmt.state != "OPERATIONAL":
            return
        with self._lock:
            for pdo in self.node.rpdo.values():
                if pdo.enabled and pdo.cob_id == can_id:
                    at = 0
                    for variable in pdo.map:
                        size = variable.length // 8
                        self.node.set_data(variable.index, variable.subindex, bytes(data[at:at + size]))
                        at += size

    def _on_sync(self, can_id, data, timestamp):
        if self.silent or self.node.nmt.state != "OPERATIONAL":
            return
        with self._lock:
            self._move()
            live = self._live()
            for pdo in self.node.tpdo.values():
                if pdo.enabled and pdo.trans_type == 1:
                    data = b"".join(v.od.encode_raw(live[v.index]) for v in pdo.map)
                    self.network.send_message(pdo.cob_id, data)

    def _on_master(self, can_id, data, timestamp):
        if not self.silent:
            self._master_heard = time.monotonic()

    def _run(self):
        while not self._ended.wait(0.005 * support.PATIENCE ** 0.5):
            with self._lock:
                self._move()
                limit_s = (self.value(0x1016, 1) & 0xFFFF) / 1000
                if self._master_heard and limit_s and time.monotonic() - self._master_heard > limit_s:
                    self._master_heard = None
                    if self.state == ENABLED:
                        self.state = QUICK_STOP
                    if not self.silent:
                        self.node.emcy.send(0x8130, 0x11)

    def unplug(self):
        """Neither hears nor says anything any more, but for its motor and its own watch."""
        self.silent = True
        self.node.nmt.stop_heartbeat()
