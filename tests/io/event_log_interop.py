# SPDX-License-Identifier: MIT
"""Reads the log OURS with LCM's own Python reader and writes the same events to THEIRS with its writer."""
import sys

import lcm
from bevel import tip_measurement_t

ours, theirs = sys.argv[1:]
out = lcm.EventLog(theirs, "w", overwrite=True)
events = list(lcm.EventLog(ours, "r"))
assert [e.eventnum for e in events] == [0, 1, 2], events
assert [e.timestamp for e in events] == [1001, 1002, 1003], events
for event in events:
    assert event.channel == "TIP_MEASUREMENT", event.channel
    message = tip_measurement_t.decode(event.data)
    assert message.position_mm[2] == message.seq, message.position_mm
    out.write_event(event.timestamp, event.channel, message.encode())
out.close()
