# SPDX-License-Identifier: MIT
"""mcap_round_trip.py SOURCE BUILD: what the Python package mcap, which shares no code with ours, reads in our files, and we
in its files: in chunks and without, with its indices and without, in another order, and as files of before were.

Exit status: 77 where the package is not there.
"""
import csv
import importlib.util
import json
import pathlib
import random
import struct
import subprocess
import sys
import tempfile

source, build = map(pathlib.Path, sys.argv[1:])
sys.path[:0] = [str(source / ".deps/python")]
try:
    from mcap.reader import NonSeekingReader, make_reader
    from mcap.writer import CompressionType, IndexType, Writer
except ModuleNotFoundError:
    print("skipped: no Python package mcap (tools/setup gets it)")
    sys.exit(77)

WHOLE = {"utime", "seq", "camera", "status", "arrival", "insertion_status", "rotation_status"}
TOPICS = {"TIP_MEASUREMENT": "tip_measurement.csv", "ACTUATOR_STATE": "actuator_state.csv"}
CONFIG = '[recording]\nclock = "none"\n'


def run(*command, status=0):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    assert done.returncode == status, f"{command}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stderr


def make_recording(folder):
    folder.mkdir()
    (folder / "tip_measurement.csv").write_text(
        "utime,seq,camera,status,x_mm,y_mm,z_mm,ixx_per_mm2,ixy_per_mm2,ixz_per_mm2,iyx_per_mm2,iyy_per_mm2,"
        "iyz_per_mm2,izx_per_mm2,izy_per_mm2,izz_per_mm2,arrival\n"
        "1700000000000001,0,0,0,,-0,5e-324,0,0,0,0,44.00000000000001,0,0,0,44,1\n"
        "1700000000033000,1,0,2,0.1,,1e-05,44,0,0,0,0,0,0,0,44,2\n")
    draw = random.Random(1)
    rows = [f"{1700000000000000 + 10000 * i},{i},2,2,{0.1 * i!r},{draw.gauss(0, 1)!r},{-0.001 * i!r},"
            f"{draw.gauss(0, 1) * 10.0 ** draw.randint(-300, 4)!r},{i if i == 0 else i + 2}" for i in range(4000)]
    (folder / "actuator_state.csv").write_text(
        "utime,seq,insertion_status,rotation_status,insertion_mm,insertion_rate_mm_s,rotation_rad,rotation_rate_rad_s,"
        "arrival\n" + "\n".join(rows) + "\n")
    (folder / "config.toml").write_text(CONFIG)


def check_values(messages, rec):
    """Each message against its row of the CSV files, which other code wrote."""
    for topic, name in TOPICS.items():
        rows = list(csv.DictReader(open(rec / name, encoding="utf-8")))
        mine = [m for m in messages if m[1].topic == topic]
        assert len(mine) == len(rows), (topic, len(mine))
        for i, ((kind, _, message), row) in enumerate(zip(mine, rows)):
            value = json.loads(message.data)
            schema = json.loads(kind.data)
            assert kind.encoding == "jsonschema" and message.sequence == i
            assert message.log_time == message.publish_time == 1000 * int(row["utime"])
            assert set(schema["required"]) <= set(value) <= set(schema["properties"])
            for column, cell in row.items():
                kind_of = schema["properties"][column]["type"]
                assert kind_of == ("integer" if column in WHOLE else "number"), (column, kind_of)
                if cell == "":
                    assert column not in value, (topic, i, column)
                else:
                    assert repr(float(value[column])) == repr(float(cell)), (topic, i, column, value[column], cell)


def check_indices(path, summary):
    """Every entry of every message index leads to the message that it says."""
    data, found = path.read_bytes(), 0
    for index in summary.chunk_indexes:
        compression = struct.unpack_from("<I", data, index.chunk_start_offset + 9 + 28)[0]
        records = index.chunk_start_offset + 9 + 28 + 4 + compression + 8
        for channel, at in index.message_index_offsets.items():
            assert data[at] == 7
            said, size = struct.unpack_from("<HI", data, at + 9)
            assert said == channel
            for i in range(0, size, 16):
                time_ns, offset = struct.unpack_from("<QQ", data, at + 15 + i)
                op, _, channel_there, _, log_time = struct.unpack_from("<BQHIQ", data, records + offset)
                assert (op, channel_there, log_time) == (5, channel, time_ns)
                found += 1
    assert found == summary.statistics.message_count


def write_anew(path, messages, change=lambda text: text, order=None, **how):
    with open(path, "wb") as file:
        writer = Writer(file, **{"compression": CompressionType.NONE, **how})
        writer.start()
        ids = {}
        for kind, channel, message in (order or list)(messages):
            if channel.topic not in ids:
                schema = writer.register_schema(kind.name, kind.encoding, kind.data)
                ids[channel.topic] = writer.register_channel(channel.topic, "json", schema)
            writer.add_message(ids[channel.topic], message.log_time, change(message.data.decode()).encode(),
                               message.publish_time, message.sequence)
        writer.add_attachment(0, 0, "config.toml", "application/toml", CONFIG.encode())
        writer.finish()


def of_before(path, rec):
    """As tools/bevel-mcap made them: a channel after the other, null for what was not seen, digits as in the CSV file."""
    with open(path, "wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start(profile="", library="bevel")
        for topic, name in TOPICS.items():
            rows = list(csv.DictReader(open(rec / name, encoding="utf-8")))
            kinds = {c: {"type": "integer"} if c in WHOLE else {"type": ["number", "null"]} for c in rows[0]}
            schema = writer.register_schema(f"bevel.{name[:-4]}", "jsonschema", json.dumps(
                {"type": "object", "properties": kinds, "required": list(rows[0])}).encode())
            channel = writer.register_channel(topic, "json", schema)
            for i, row in enumerate(rows):
                text = "{" + ",".join(f'"{c}":{v or "null"}' for c, v in row.items()) + "}"
                writer.add_message(channel, 1000 * int(row["utime"]), text.encode(), 1000 * int(row["utime"]), i)
        writer.add_attachment(0, 0, "config.toml", "application/toml", CONFIG.encode())
        writer.finish()


def turned_round(text):
    return json.dumps(dict(reversed(json.loads(text).items())), indent=1)


def shuffled(messages):
    messages = list(messages)
    random.Random(2).shuffle(messages)
    return messages


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    rec = here / "csv/rec"
    rec.parent.mkdir()
    make_recording(rec)
    run(build / "bin/bevel-import", "-o", here, rec)
    log = (here / "rec.lcm").read_bytes()
    run(build / "bin/bevel-export", "--format", "mcap", "-o", here, here / "rec.lcm")

    with open(here / "rec.mcap", "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        messages = list(reader.iter_messages(log_time_order=False))
        config = {a.name: a.data.decode() for a in reader.iter_attachments()}
    assert config == {"config.toml": CONFIG}, config
    assert len(summary.chunk_indexes) > 1 and summary.statistics.message_count == len(messages) == 4002
    assert {summary.channels[i].topic: n for i, n in summary.statistics.channel_message_counts.items()} == {
        "TIP_MEASUREMENT": 2, "ACTUATOR_STATE": 4000}
    with open(here / "rec.mcap", "rb") as file:  # from the front, with the CRC-32 of all the data
        assert [m.data for _, _, m in NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False)] == [
            m.data for _, _, m in messages]
    check_values(messages, rec)
    check_indices(here / "rec.mcap", summary)

    def comes_back(path):
        folder = here / f"{path.stem}.logs"
        run(build / "bin/bevel-import", "-o", folder, path)
        assert (folder / f"{path.stem}.lcm").read_bytes() == log, path

    comes_back(here / "rec.mcap")
    ways = {"chunks": {"chunk_size": 20000}, "no_chunks": {"use_chunking": False},
            "data_crc": {"chunk_size": 20000, "enable_data_crcs": True},
            "no_chunks_data_crc": {"use_chunking": False, "enable_data_crcs": True},
            "no_indices": {"index_types": IndexType.NONE, "repeat_channels": False, "repeat_schemas": False,
                           "use_statistics": False, "use_summary_offsets": False},
            "no_crc": {"enable_crcs": False},
            "turned_round": {"change": turned_round}, "shuffled": {"order": shuffled, "chunk_size": 20000}}
    # The package mcap compresses with these; without them tests/io/test_mcap.cpp alone has compressed files.
    for kind in (CompressionType.ZSTD, CompressionType.LZ4):
        if importlib.util.find_spec({"ZSTD": "zstandard", "LZ4": "lz4"}[kind.name]) is not None:
            ways[kind.name.lower()] = {"compression": kind, "chunk_size": 20000}
    for way, how in ways.items():
        write_anew(here / f"{way}.mcap", messages, **how)
        comes_back(here / f"{way}.mcap")
    of_before(here / "before.mcap", rec)
    comes_back(here / "before.mcap")

    whole = (here / "chunks.mcap").read_bytes()
    chunk = whole.index(struct.pack("<I", 0), whole.index(b"\x06", 8) + 9 + 28)  # where its compression's name is
    compressed = bytearray(whole)
    compressed[chunk:chunk + 4] = struct.pack("<I", 4)
    compressed[chunk + 4:chunk + 4] = b"xz-5"
    at = whole.index(b"\x06", 8)
    compressed[at + 1:at + 9] = struct.pack("<Q", struct.unpack_from("<Q", whole, at + 1)[0] + 4)
    (here / "xz.mcap").write_bytes(compressed)
    said = run(build / "bin/bevel-import", "-o", here / "bad", here / "xz.mcap", status=1)
    assert "xz.mcap" in said and "compression is 'xz-5'" in said, said
    with open(here / "other.mcap", "wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        writer.add_message(writer.register_channel("/imu", "json", 0), 1, b"{}", 1)
        writer.finish()
    assert "no message that can be used, of 1" in run(build / "bin/bevel-import", "-o", here / "bad", here / "other.mcap",
                                                      status=1)
print("ok")
