# SPDX-License-Identifier: MIT
"""The commands in a page of documentation: those that stand as code, one a line, and those that stand in a sentence."""
import dataclasses
import re
import shlex

PROGRAM = re.compile(r"(build/bin/|tools/|tests/[a-z_]+/|\.ci/|bevel-|cmake\b|ctest\b|sudo\b)")


@dataclasses.dataclass(frozen=True)
class Command:
    page: str
    line: int
    text: str
    words: tuple

    @property
    def program(self):
        return self.words[0]

    @property
    def options(self):
        return [word.split("=")[0] for word in self.words[1:] if re.match(r"--?[a-zA-Z]", word)]


def commands_of(page, text):
    """All of them, those in sentences too, in the page's order."""
    return sorted(set(in_blocks(page, text)) | set(in_sentences(page, text)), key=lambda c: (c.line, c.text))


def in_blocks(page, text):
    """Indented and fenced code. What a line of code is part of (a loop, a list of folders) is not looked at."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    "):
            yield from commands_in(page, number, line.strip())


def in_sentences(page, text):
    for found in re.finditer(r"`([^`]+)`", re.sub(r"```.*?```", lambda m: re.sub(r"[^\n]", " ", m[0]), text, flags=re.S)):
        number = text.count("\n", 0, found.start()) + 1
        yield from commands_in(page, number, " ".join(found[1].split()))


def commands_in(page, number, line):
    if not PROGRAM.match(line):
        return
    try:
        words = shlex.split(line, comments=True)
    except ValueError:  # a quote that is none: prose
        return
    one = []
    for word in [*words, "&&"]:
        if word in ("&&", "|", ";", "<<END"):
            if one and PROGRAM.match(one[0]):
                yield Command(page, number, " ".join(one), tuple(one))
            one = []
        else:
            # [--option] may be left out; "..." goes on like what stands before it
            word = word.strip("[],")
            if word not in ("", "...", "or"):
                one.append(word)
