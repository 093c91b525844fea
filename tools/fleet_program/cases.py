# SPDX-License-Identifier: MIT
"""The cases of a fleet, from a table or from a folder of case folders; and the key under which a case's result is kept."""
import csv
import dataclasses
import datetime
import difflib
import hashlib
import json
import pathlib
import re
import struct
import tomllib

COLUMNS = ("case", "rig", "date", "model", "logs")
LOG_HEADER = struct.Struct(">IQQ")  # of an LCM log's event: sync word, number, time in us
LOG_SYNC = 0xEDA1DA01
SEPARATORS = (",", ";", "\t", "|")
# As io/include/bevel/io/find_logs.hpp: lcm-logger's names, also of rotated and split logs.
LOG_NAME = re.compile(r"(.*\.lcm(\.\d+)?|lcmlog-[^.]*(\.\d+)?)")
MAYBE_LOG_NAME = re.compile(r"[^.]+|.*\.\d+")  # a log if it begins as one


class Fault(Exception):
    """Bad input, said in one sentence a line."""


@dataclasses.dataclass
class Case:
    name: str
    rig: str
    date: datetime.datetime  # without a zone, UTC
    model: pathlib.Path
    logs: list
    key: str = ""  # hash of what its result depends on


def read_fleet(path):
    """The cases of `path`; Fault names all that is wrong, not the first of it."""
    if path.is_dir():
        return from_folder(path)
    if not path.exists():
        raise Fault(f"{path}: is not there")
    if path.suffix not in (".csv", ".toml"):
        raise Fault(f"{path}: is no fleet; allowed: .csv, .toml, or a folder of case folders")
    try:
        rows = from_csv(path) if path.suffix == ".csv" else from_toml(path)
    except UnicodeDecodeError as reason:
        raise Fault(f"{path}: {reason}; allowed: UTF-8, in a spreadsheet \"CSV UTF-8\"") from None
    except csv.Error as reason:
        raise Fault(f"{path}: {reason}") from None
    faults, cases, places = [], [], {}
    for place, row in rows:
        try:
            case = from_row(row, path.parent)
            if case.name in places:
                raise Fault(f"case '{case.name}' is there already, {places[case.name]}")
            places[case.name] = place
            cases.append(case)
        except Fault as fault:
            faults.append(f"{place}: {fault}")
    if faults:
        raise Fault("\n".join(faults))
    if not cases:
        raise Fault(f"{path}: has no case")
    return cases


def is_log(path):
    """Whether a file of a folder is a log, by its name or else by how it begins."""
    name = path.name
    if name.startswith(".") or path.is_dir():
        return False
    if LOG_NAME.fullmatch(name):
        return True
    if not MAYBE_LOG_NAME.fullmatch(name) or not path.is_file():
        return False
    with open(path, "rb") as file:
        return file.read(4) == LOG_SYNC.to_bytes(4, "big")


def logs_in(folder):
    """Its logs, numbers in names by value: rec.lcm.2 before rec.lcm.10."""
    return sorted((path for path in folder.iterdir() if is_log(path)),
                  key=lambda path: [(int(part), "") if part.isdigit() else (-1, part)
                                    for part in re.split(r"([0-9]+)", path.name)])


def check_columns(names, place):
    for name in names:
        if name not in COLUMNS:
            nearest = difflib.get_close_matches(str(name), COLUMNS, 1)
            hint = f"; did you mean '{nearest[0]}'?" if nearest else f"; allowed: {', '.join(COLUMNS)}"
            raise Fault(f"{place}: unknown column '{name}'{hint}")


def separated_lines(file, place):
    """The separator of a table and its lines, without comments and the line `sep=;` that spreadsheets put first."""
    lines = list(file)
    separator = None
    if lines and lines[0].strip().strip('"').lower().startswith("sep="):
        separator = lines[0].strip("\r\n").strip('"')[4:5]
        if separator not in SEPARATORS:
            raise Fault(f"{place}:1: the separator in {lines[0].strip()!r} is not known; allowed: sep= with a comma, "
                        "semicolon, pipe or tab")
        lines[0] = "\n"
    for i, line in enumerate(lines):  # blank, so that line numbers stay
        if not line.strip():
            continue
        behind = line.lstrip("# \t")
        if line.startswith("#") and behind.strip() and re.split("[;,|\t]", behind)[0].strip(' "\r\n') in COLUMNS:
            lines[i] = line = behind  # a header behind a comment mark
        if line.startswith("#"):
            lines[i] = "\n"
            continue
        return separator or max(SEPARATORS, key=line.count), lines
    return ",", lines


def from_csv(path):
    with open(path, newline="", encoding="utf-8-sig") as file:
        separator, text = separated_lines(file, path)
    lines = csv.reader(text, strict=True, delimiter=separator, skipinitialspace=True)
    columns = next((cells for cells in lines if cells), [])
    header = max(1, lines.line_num)
    columns = [name.strip() for name in columns]
    while columns and not columns[-1]:
        columns.pop()
    check_columns(columns, f"{path}:{header}")
    for name in COLUMNS:
        if columns.count(name) != 1 and not (name == "date" and name not in columns):
            raise Fault(f"{path}:{header}: {'no column' if name not in columns else 'twice the column'} '{name}'")
    rows = []
    for cells in lines:
        while len(cells) > len(columns) and not cells[-1].strip():
            cells.pop()
        if not any(cell.strip() for cell in cells):
            continue
        place = f"{path}:{lines.line_num}"
        if len(cells) != len(columns):
            hint = '; several logs in a table with semicolons stand in quotes: "a.lcm; b.lcm"' \
                if separator == ";" and len(cells) > len(columns) else ""
            raise Fault(f"{place}: has {len(cells)} cells, and the header names {len(columns)}{hint}")
        row = dict(zip(columns, cells))
        row["logs"] = [log.strip() for log in row["logs"].split(";") if log.strip()]
        rows.append((place, row))
    return rows


def from_toml(path):
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as reason:
        raise Fault(f"{path}: {reason}") from None
    for name in table:
        if name != "cases":
            raise Fault(f"{path}: unknown key '{name}'; allowed: [[cases]]")
    rows = table.get("cases", [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise Fault(f"{path}: 'cases' is no list of tables; write [[cases]]")
    for number, row in enumerate(rows, 1):
        place = f"{path}: case {number}"
        check_columns(row, place)
        for name in COLUMNS:
            if name not in row and name != "date":
                raise Fault(f"{place}: no '{name}'")
        logs = row["logs"] if isinstance(row["logs"], list) else [row["logs"]]
        if not all(isinstance(text, str) for text in [row["case"], row["rig"], row["model"], *logs]):
            raise Fault(f"{place}: case, rig and model are texts, logs a list of texts")
        row["logs"] = logs
    return [(f"{path}: case {number}", row) for number, row in enumerate(rows, 1)]


def from_row(row, folder):
    for name in ("case", "rig", "model"):
        if not row[name].strip():
            raise Fault(f"'{name}' is empty")
    model = folder / row["model"].strip()
    if not model.is_file():
        raise Fault(f"model '{model}' is no file")
    logs = []
    for name in row["logs"]:
        log = folder / name
        found = logs_in(log) if log.is_dir() else [log]
        if not found:
            raise Fault(f"logs '{log}' is a folder without any log (*.lcm, lcmlog-*)")
        if not found[0].is_file():
            raise Fault(f"log '{log}' is no file")
        logs += found
    if not logs:
        raise Fault("'logs' is empty")
    return Case(row["case"].strip(), row["rig"].strip(), date_of(row.get("date", ""), logs), model.resolve(),
                [log.resolve() for log in logs])


def date_of(written, logs):
    """As written; else that of the first event of the first log."""
    if isinstance(written, str) and written.strip():
        try:
            written = datetime.datetime.fromisoformat(written.strip())
        except ValueError:
            raise Fault(f"date '{written}' is no date; allowed: 2026-03-31 or 2026-03-31T14:30") from None
    if isinstance(written, datetime.datetime):
        return written.astimezone(datetime.timezone.utc).replace(tzinfo=None) if written.tzinfo else written
    if isinstance(written, datetime.date):
        return datetime.datetime(written.year, written.month, written.day)
    if written:
        raise Fault(f"date {written!r} is no date; allowed: 2026-03-31 or 2026-03-31T14:30")
    with open(logs[0], "rb") as file:
        head = file.read(LOG_HEADER.size)
    if len(head) == LOG_HEADER.size and LOG_HEADER.unpack(head)[0] == LOG_SYNC:
        time_s = LOG_HEADER.unpack(head)[2] / 1e6
        if time_s < 253402300800:  # of the year 10000
            return datetime.datetime.fromtimestamp(time_s, datetime.timezone.utc).replace(tzinfo=None)
    return datetime.datetime(1970, 1, 1)  # no log at all: the case's own message says so


def from_folder(folder):
    cases = []
    for model in sorted(folder.rglob("model.toml")):
        logs = logs_in(model.parent)
        if not logs:
            continue
        inside = model.parent.relative_to(folder)
        rig = inside.parent if len(inside.parts) > 1 else pathlib.Path(folder.resolve().name)
        name = str(inside) if inside.parts else folder.resolve().name
        cases.append(Case(name, str(rig), date_of("", logs), model.resolve(), [log.resolve() for log in logs]))
    if not cases:
        raise Fault(f"{folder}: no folder in it has both a model.toml and a log (*.lcm, lcmlog-*)")
    return cases


def sha256_of(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def digests(model, logs):
    """Names and contents: a verdict names its recordings."""
    return {"model": [model.name, sha256_of(model)], "logs": [[log.name, sha256_of(log)] for log in logs]}


def specification(case, program, program_sha256, options):
    """What one_case.py needs; the key is the hash of what the result depends on, not of where the files lie. Options say
    how the work is split and are no part of it: the verdict does not depend on threads."""
    depends_on = {"program_sha256": program_sha256, **digests(case.model, case.logs)}
    key = hashlib.sha256(json.dumps(depends_on, sort_keys=True).encode()).hexdigest()[:32]
    return {"key": key, "program": str(program), "options": options, "model_path": str(case.model),
            "log_paths": [str(log) for log in case.logs], **depends_on}
