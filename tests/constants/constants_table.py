# SPDX-License-Identifier: MIT
"""The table of constants in docs/diagnosis.md, and where in the code each stands."""
import dataclasses
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/diagnosis.md"
NUMBER = r"[-+]?(?:\d[\d']*\.?\d*|\.\d+)(?:e[-+]?\d+)?(?:\s*/\s*\d+)?"


@dataclasses.dataclass(frozen=True)
class Constant:
    name: str
    file: pathlib.Path  # below ROOT
    said: str  # its value in the table; "" where the table lists several in words
    set_by: str

    @property
    def key(self):
        return f"{self.file.stem}:{self.name}"

    def definition(self, text):
        """The match of its definition in a file's text, its value as group "value"; None if there is none alone."""
        found = list(re.finditer(rf"(?<![.\w]){self.name}\s*=\s*(?P<value>{NUMBER})\s*(?=[,;])", text))
        return found[0] if len(found) == 1 else None


def files_of(cell):
    for name in re.split(r"[,;]\s*", cell):
        for folder in ("diagnosis/src", "diagnosis/include/bevel/diagnosis", "model/include", "."):
            if (ROOT / folder / name).is_file():
                yield pathlib.Path(folder) / name


def rows():
    """Cells of each row of the table."""
    section = PAGE.read_text().split("\n## Constants\n", 1)[1].split("\n##", 1)[0]
    lines = [line for line in section.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def constants():
    """All that the table calls by a name of the code, in its order."""
    found = []
    for name_cell, value_cell, file_cell, _, set_by in rows():
        names = re.findall(r"`(\w+)`", name_cell)
        values = [v.strip() for v in re.split(r"[,;](?![^(]*\))", value_cell)]
        files = list(files_of(file_cell))
        for i, name in enumerate(names):
            said = values[i] if len(values) == len(names) else ""
            in_files = [f for f in files if re.search(rf"\b{name}\b", (ROOT / f).read_text())]
            found += [Constant(name, f, said, set_by) for f in in_files[:1] or [pathlib.Path(file_cell)]]
    return found


def number(text):
    """Of "0.2 s" or "1/30" the number; None where it begins with none."""
    match = re.match(NUMBER, text.replace("'", ""))
    if not match:
        return None
    above, _, below = match[0].partition("/")
    return float(above) / float(below or 1)
