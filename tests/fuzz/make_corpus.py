# SPDX-License-Identifier: MIT
"""Writes the seeds of the fuzz targets that are easier made than typed, into corpus/ beside this file.

PYTHONPATH=build/lcmtypes/python python3 tests/fuzz/make_corpus.py

Seeds are committed; this runs again only when a message or a target's input format changes. It leaves other files alone.
"""
import pathlib
import struct

import bevel

CORPUS = pathlib.Path(__file__).resolve().parent / "corpus"
UTIME = 1_700_000_000_000_000


def keep(target, name, data):
    folder = CORPUS / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)


def message(kind, **fields):
    m = getattr(bevel, kind)()
    m.utime, m.seq = UTIME, 1
    for name, value in fields.items():
        setattr(m, name, value)
    return m.encode()


TIP = message("tip_measurement_t", position_mm=[0.5, -1, 30], information_per_mm2=[100, 0, 0, 0, 100, 0, 0, 0, 4])
HEADING = message("tip_heading_t", heading=[0, 0.6, 0.8],
                  information_per_rad2=[2500, 0, 0, 0, 1600, -1200, 0, -1200, 900])
ACTUATOR = message("actuator_state_t", axis_status=[2, 2], insertion_mm=31.0, rotation_rad=-2.5)
COMMAND = message("motion_command_t", mode=1, insertion_rate_mm_s=5.0, rotation_rate_rad_s=-3.0)
NEEDLE = message("needle_state_t", measurement_utime=UTIME - 9, orientation_wxyz=[1, 0, 0, 0], curvature_per_mm=0.0047,
                 covariance=[float(i % 10 == 0) for i in range(81)], rank=3)
SHAFT = message("needle_shaft_t", bending_mm=40.0, bending_sd_mm=8.0, guide_mm=15.0)
TARGET = message("steering_target_t", request=1, position_mm=[4, -10, 95], tolerance_mm=0.5)
HEARTBEAT = message("operator_heartbeat_t", session=7)
STATUS = message("process_status_t", process="bevel-estimator", state="running", state_code=1, reason="", loop_period_s=0.02)


def decode():
    for name, data in [("tip", TIP), ("heading", HEADING), ("actuator", ACTUATOR), ("command", COMMAND), ("needle", NEEDLE), ("shaft", SHAFT),
                       ("target", TARGET), ("heartbeat", HEARTBEAT), ("status", STATUS)]:
        keep("checked_decode", name, data)
    keep("checked_decode", "empty", b"")
    keep("checked_decode", "trailing_byte", TIP + b"\0")
    keep("checked_decode", "a_byte_short", TARGET[:-1])
    keep("checked_decode", "fingerprint_only", COMMAND[:8])
    keep("checked_decode", "nan_position", message("tip_measurement_t", position_mm=[0, float("nan"), 1]))
    keep("checked_decode", "infinite_rate", message("motion_command_t", insertion_rate_mm_s=float("-inf")))
    keep("checked_decode", "no_quaternion", message("needle_state_t", orientation_wxyz=[1, 1, 0, 0]))
    keep("checked_decode", "negative_variance", message("tip_measurement_t", information_per_mm2=[-1] + [0] * 8))
    keep("checked_decode", "heading_of_no_length", message("tip_heading_t"))
    keep("checked_decode", "heading_not_seen", message("tip_heading_t", status=1))
    keep("checked_decode", "heading_known_along_itself", message(
        "tip_heading_t", heading=[0, 0, 1], information_per_rad2=[100, 0, 0, 0, 100, 0, 0, 0, 100]))
    keep("checked_decode", "utime_largest", message("motion_command_t", utime=2**63 - 1))
    keep("checked_decode", "utime_one", message("motion_command_t", utime=1))
    keep("checked_decode", "seq_negative", message("motion_command_t", seq=-1))
    keep("checked_decode", "text_utf8", message("process_status_t", process="N\u00e4del", state="\u20ac", reason="x"))
    # Lengths of the first string that LCM's own decoder takes at its word.
    for name, length in [("zero", 0), ("minus_one", 2**32 - 1), ("2_28", 2**28), ("2_31_less_one", 2**31 - 1),
                         ("one_less", 15), ("one_more", 17)]:
        keep("checked_decode", "text_length_" + name, STATUS[:32] + struct.pack(">I", length) + STATUS[36:])
    keep("checked_decode", "text_with_zero_inside", STATUS.replace(b"running", b"run\0ing"))


def event(number, channel, data, data_length=None, channel_length=None, magic=0xEDA1DA01):
    return struct.pack(">IqqII", magic, number, 1000 + number % 2**32,
                       len(channel) if channel_length is None else channel_length,
                       len(data) if data_length is None else data_length) + channel + data


def logs():
    first = event(0, b"CONFIG", b"[needle]\n")
    tip = event(1, b"TIP_MEASUREMENT", TIP)
    actuator = event(2, b"ACTUATOR_STATE", ACTUATOR)
    whole = (first + tip + actuator + event(3, b"MOTION_COMMAND", COMMAND) + event(4, b"NEEDLE_STATE", NEEDLE)
             + event(5, b"NEEDLE_TRUTH", NEEDLE) + event(6, b"STEERING_TARGET", TARGET)
             + event(7, b"PROCESS_STATUS", STATUS) + event(8, b"TIP_HEADING", HEADING))
    keep("log_reader", "whole", whole)
    keep("log_reader", "empty", b"")
    keep("log_reader", "torn_tail", first + tip + actuator[:-3])
    keep("log_reader", "torn_header", first + tip + actuator[:20])
    keep("log_reader", "torn_magic", first + tip + actuator[:2])
    keep("log_reader", "data_length_2_31_less_one", first + event(1, b"TIP_MEASUREMENT", TIP, 2**31 - 1) + actuator)
    keep("log_reader", "data_length_minus_one", first + event(1, b"TIP_MEASUREMENT", TIP, 2**32 - 1) + actuator)
    keep("log_reader", "channel_length_zero", first + event(1, b"TIP_MEASUREMENT", TIP, None, 0) + actuator)
    keep("log_reader", "channel_length_minus_one", first + event(1, b"TIP", TIP, None, 2**32 - 1) + actuator)
    keep("log_reader", "channel_of_64", event(0, b"A" * 64, b"x") + actuator)
    keep("log_reader", "channel_of_63", event(0, b"A" * 63, b"x") + actuator)
    keep("log_reader", "channel_unprintable", event(0, b"A\nB", b"x") + actuator)
    keep("log_reader", "garbage_between", first + b"\xed\xa1 between \xed\xa1\xda\x01" + tip + actuator)
    keep("log_reader", "damaged_magic", first + event(1, b"TIP_MEASUREMENT", TIP, magic=0xEDA1DA00) + actuator)
    keep("log_reader", "number_smallest", event(0, b"A", b"x") + b"\0" * 4 + struct.pack(">q", -(2**63)) + tip)
    keep("log_reader", "number_largest", event(2**63 - 1, b"A", b"x") + b"\0" * 4 + struct.pack(">q", -(2**63)) + tip)
    keep("log_reader", "event_inside_data", event(0, b"RAW", tip) + actuator)
    keep("log_reader", "array_length_2_28", event(0, b"OTHER", b"\x01" * 8 + struct.pack(">i", 2**28)) + tip)
    keep("log_reader", "wrong_type", event(0, b"TIP_MEASUREMENT", ACTUATOR) + actuator)
    keep("log_reader", "nan_in_a_tip", event(0, b"TIP_MEASUREMENT", message(
        "tip_measurement_t", position_mm=[0, 0, float("nan")])))


def mcap():
    """Small MCAP files without CRC-32 (0: none), so that what is mutated is looked at and not refused at once."""
    def record(op, content):
        return bytes([op]) + struct.pack("<Q", len(content)) + content

    def text(value):
        return struct.pack("<I", len(value)) + value

    def channel(number, topic):
        return record(4, struct.pack("<HH", number, 0) + text(topic) + text(b"json") + text(b""))

    def one(number, sequence, data):
        return record(5, struct.pack("<HIQQ", number, sequence, 1000 * UTIME, 1000 * UTIME) + data)

    def chunk(records, compression=b"", crc=0, size=None):
        return record(6, struct.pack("<QQQI", 0, 0, len(records) if size is None else size, crc) + text(compression)
                      + struct.pack("<Q", len(records)) + records)

    def whole(*records, summary=b""):
        front = magic + record(1, text(b"") + text(b"")) + b"".join(records) + record(15, struct.pack("<I", 0))
        start = len(front) if summary else 0
        return front + summary + record(2, struct.pack("<QQI", start, 0, 0)) + magic

    magic = b"\x89MCAP0\r\n"
    command = b'{"utime":5,"seq":0,"mode":1,"insertion_rate_mm_s":0.1,"rotation_rate_rad_s":-0.0}'
    tip = (b'{"utime":5,"seq":0,"camera":0,"status":0,"x_mm":1.5,"unseen_y_mm":2,"ixx_per_mm2":44,"ixy_per_mm2":0,'
           b'"ixz_per_mm2":0,"iyx_per_mm2":0,"iyy_per_mm2":0,"iyz_per_mm2":0,"izx_per_mm2":0,"izy_per_mm2":0,'
           b'"izz_per_mm2":0,"arrival":3}')
    commands, tips = channel(1, b"MOTION_COMMAND"), channel(2, b"TIP_MEASUREMENT")
    config = struct.pack("<QQ", 0, 0) + text(b"config.toml") + text(b"") + struct.pack("<Q", 5) + b"a = 1" + bytes(4)
    statistics = record(11, struct.pack("<QHIIIIQQI", 3, 0, 2, 1, 0, 1, 0, 0, 0))
    keep("mcap", "whole", whole(chunk(commands + tips + one(1, 0, command) + one(2, 0, tip)), one(1, 1, command),
                                record(9, config), summary=commands + tips + statistics))
    keep("mcap", "empty", b"")
    keep("mcap", "magic_alone", magic)
    keep("mcap", "no_records", whole())
    keep("mcap", "channel_not_said", whole(one(7, 0, command)))
    keep("mcap", "other_order", whole(commands, one(1, 0, b'{ "seq": 0, "utime": 5, "rotation_rate_rad_s": 0, '
                                                          b'"insertion_rate_mm_s": 1e-1, "mode": 1 }')))
    keep("mcap", "of_before", whole(tips, one(2, 0, tip.replace(b"unseen_y_mm\":2", b"y_mm\":null"))))
    keep("mcap", "not_finite", whole(commands, one(1, 0, command.replace(b"0.1", b"nan"))))
    keep("mcap", "deep", whole(commands, one(1, 0, b"[" * 2000)))
    keep("mcap", "compressed", whole(chunk(commands + one(1, 0, command), b"zstd")))
    keep("mcap", "chunk_of_2_63", whole(chunk(commands, size=2**63)))
    keep("mcap", "wrong_crc", whole(chunk(commands + one(1, 0, command), crc=1), one(1, 1, command)))
    keep("mcap", "length_of_2_63", magic + bytes([5]) + struct.pack("<Q", 2**63) + command)
    keep("mcap", "cut", whole(commands, one(1, 0, command))[:-20])
    keep("mcap", "sequences_turned", whole(commands, one(1, 9, command), one(1, 3, command)))


def frame(identifier, *data):  # operation 3 of fuzz_can_frames: inject
    return bytes([3]) + struct.pack("<H", identifier) + bytes([len(data), *data])


def cycles(count):
    return bytes([0, count - 1])


def setpoint(insertion, rotation, age_ns=0, run=1):
    return bytes([11, run | 2 | 4]) + struct.pack("<ddq", insertion, rotation, age_ns)


def can():
    enabled, ready, off, alone = b"\3", b"\2", b"\1", b"\0"
    keep("can_frames", "moves_and_stops", enabled + setpoint(5, -3) + cycles(30) + bytes([8]) + cycles(9) + bytes([9])
         + cycles(32) + cycles(32) + cycles(32) + cycles(32) + bytes([6]) + cycles(20))
    keep("can_frames", "enable_disable", ready + bytes([6]) + cycles(9) + bytes([7]) + cycles(9) + bytes([6, 0, 9]))
    keep("can_frames", "nan_setpoint", enabled + setpoint(float("nan"), 0) + cycles(32))
    keep("can_frames", "over_every_limit", enabled + setpoint(1e300, -1e300) + cycles(32))
    keep("can_frames", "setpoint_from_the_future", enabled + setpoint(1, 1, -(2**62)) + cycles(32))
    keep("can_frames", "setpoint_of_long_ago", enabled + setpoint(1, 1, 2**63 - 1) + cycles(32))
    keep("can_frames", "emergency", enabled + frame(0x81, 0x30, 0x81, 0x11, 0, 0, 0, 0, 0) + cycles(5) + bytes([9]))
    keep("can_frames", "foreign_master", enabled + frame(0x201, 0x0F, 0, 0xFF, 0xFF, 0xFF, 0x7F) + cycles(5))
    keep("can_frames", "foreign_master_while_off", off + frame(0x80) + cycles(32))
    keep("can_frames", "unasked_boot_up", enabled + frame(0x701, 0) + cycles(5))
    keep("can_frames", "short_pdos", enabled + frame(0x181, 0x37) + frame(0x281, 1, 2) + frame(0x701) + cycles(9))
    keep("can_frames", "position_wraps", ready + frame(0x281, 0xFF, 0xFF, 0xFF, 0x7F, 3)
         + frame(0x281, 0, 0, 0, 0x80, 3) + cycles(5))
    keep("can_frames", "wrong_mode", enabled + frame(0x282, 0, 0, 0, 0, 1) + cycles(3))
    keep("can_frames", "link_down_and_up", enabled + setpoint(5, 0) + cycles(9) + bytes([12, 5]) + cycles(20)
         + bytes([12, 0]) + cycles(32) + bytes([9]) + cycles(32))
    keep("can_frames", "nobody_acknowledges", enabled + setpoint(5, 0) + bytes([12, 6]) + cycles(32) + bytes([12, 1])
         + cycles(9))
    keep("can_frames", "bus_off", enabled + bytes([12, 7]) + cycles(9) + bytes([9]) + cycles(32))
    keep("can_frames", "frames_lost", enabled + setpoint(5, 2) + bytes([12, 13]) + cycles(32))
    keep("can_frames", "frames_altered", enabled + setpoint(5, 2) + bytes([12, 9]) + cycles(32))
    keep("can_frames", "drive_faults", enabled + bytes([13, 16, 0x11, 0x86]) + cycles(9) + bytes([9]) + cycles(32) * 4)
    keep("can_frames", "drive_power_cycled", enabled + bytes([13, 12]) + cycles(32) + bytes([9]) + cycles(32) * 4
         + bytes([6, 14, 1, 6]) + cycles(9))
    keep("can_frames", "motor_blocked", enabled + setpoint(20, 0) + bytes([13, 8]) + cycles(32) * 2)
    keep("can_frames", "late_step", enabled + setpoint(5, 0) + bytes([15, 0xFF, 0xFF]) + cycles(3))
    keep("can_frames", "drives_that_are_not_there", alone + cycles(32) + bytes([5, 0, 0x4F, 1, 2, 3, 4]) + cycles(32))


def sdo():
    arbitrary, drive = b"\1", b"\0"
    upload = lambda index, sub: b"\0" + struct.pack("<HB", index, sub)
    download = lambda index, sub, size, value: b"\2" + struct.pack("<HBBI", index, sub, size - 1, value)
    answer = lambda command, value=0, shape=1: b"\4" + bytes([command, 0, 0, 0]) + struct.pack("<IB", value, shape)
    sent, wait, cancel = b"\3", b"\5" + struct.pack("<I", 500_000_000), b"\6"
    keep("sdo_client", "upload", arbitrary + upload(0x6061, 0) + sent + answer(0x4F, 3))
    keep("sdo_client", "upload_of_four", arbitrary + upload(0x1000, 0) + sent + answer(0x43, 0x40192))
    keep("sdo_client", "download", arbitrary + download(0x6060, 0, 1, 3) + sent + answer(0x60))
    keep("sdo_client", "answer_of_another_object", arbitrary + upload(0x6061, 0) + sent + answer(0x4F, 3, 0) + wait)
    keep("sdo_client", "answer_to_another_request", arbitrary + upload(0x6061, 0) + sent + answer(0x60) + wait + sent)
    keep("sdo_client", "abort", arbitrary + download(0x1017, 0, 2, 30) + sent + answer(0x80, 0x06020000))
    keep("sdo_client", "segmented", arbitrary + upload(0x1008, 0) + sent + answer(0x41, 20) + sent)
    keep("sdo_client", "segmented_then_another", arbitrary + upload(0x1008, 0) + sent + answer(0x41, 20)
         + upload(0x1000, 0) + sent + answer(0x43, 1))
    keep("sdo_client", "short_answer", arbitrary + upload(0x6061, 0) + sent + answer(0x4F, 3, 0x81) + wait)
    keep("sdo_client", "late_answer", arbitrary + upload(0x6061, 0) + sent + wait + answer(0x4F, 3) + sent)
    keep("sdo_client", "given_up_then_another", arbitrary + upload(0x6061, 0) + sent + wait + upload(0x6064, 0) + sent
         + answer(0x43, 9))
    keep("sdo_client", "cancelled", arbitrary + upload(0x6061, 0) + sent + cancel + answer(0x4F, 3))
    keep("sdo_client", "drive_answers", drive + b"\0" + struct.pack("<HB", 0x6502, 0)
         + b"\1" + struct.pack("<HBBI", 0x6040, 0, 1, 6) + b"\1" + struct.pack("<HBBI", 0x1017, 0, 1, 30))
    keep("sdo_client", "drive_refuses", drive + b"\1" + struct.pack("<HBBI", 0x1000, 0, 3, 6)
         + b"\0" + struct.pack("<HB", 0x1018, 9) + b"\1" + struct.pack("<HBBI", 0x1600, 0, 0, 2))


if __name__ == "__main__":
    decode()
    logs()
    mcap()
    can()
    sdo()
