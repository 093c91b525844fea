#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws modules.svg: the modules with their lines of C++, each above the modules whose headers it includes, at the commit
before the libraries could be installed and in the working tree. An arrow that follows from two others is left out.

    python3 docs/pictures/draw_modules.py > docs/pictures/modules.svg
"""
import collections
import pathlib
import re
import subprocess

BEFORE = "0b0d29a"
OUTSIDE = {"tests", "build", "examples", "third_party", "docs"}
WIDTH, HEIGHT, STEP_X, STEP_Y, MARGIN = 104, 40, 122, 84, 24


def sources_before():
    """Yields path and text of each C++ file of the commit BEFORE."""
    paths = subprocess.run(["git", "ls-tree", "-r", "--name-only", BEFORE], check=True, capture_output=True, text=True)
    for path in paths.stdout.split():
        if re.search(r"\.[ch]pp$", path):
            yield path, subprocess.run(["git", "show", f"{BEFORE}:{path}"], check=True, capture_output=True,
                                       text=True).stdout


def sources_now():
    """Yields path and text of each C++ file that git lists now."""
    paths = subprocess.run(["git", "ls-files", "*.cpp", "*.hpp"], check=True, capture_output=True, text=True)
    for path in paths.stdout.split():
        yield path, pathlib.Path(path).read_text()


def read(sources):
    """Returns the lines of each module and the set of modules that it includes."""
    lines, edges = collections.Counter(), collections.defaultdict(set)
    for path, text in sources:
        module = path.split("/")[0]
        if module in OUTSIDE:
            continue
        lines[module] += text.count("\n")
        for name in re.findall(r'#include (?:<bevel/|")(\w+)(?:/|\.hpp)', text):
            edges[module].add("core" if name == "error" else name)
    return lines, {m: {e for e in edges[m] if e in lines and e != m} for m in lines}


def reduced(edges):
    """Returns the edges without those that follow from a path of others."""
    def reaches(module, other):
        return other in edges[module] or any(reaches(e, other) for e in edges[module])
    return {m: {e for e in edges[m] if not any(reaches(via, e) for via in edges[m] - {e})} for m in edges}


def levels(edges):
    """Returns the level of each module: one above the highest module that it includes."""
    level = {}

    def of(module, path=()):
        if module in path:
            return 0
        if module not in level:
            level[module] = 1 + max((of(e, (*path, module)) for e in edges[module]), default=0)
        return level[module]

    for module in edges:
        of(module)
    return level


def draw(title, lines, edges, left):
    """Returns the SVG elements of one graph and its width and height."""
    level = levels(edges)
    rows = collections.defaultdict(list)
    for module in sorted(level):
        rows[level[module]].append(module)
    top, widest = max(rows), max(map(len, rows.values()))
    at = {m: (left + (widest - len(row)) * STEP_X / 2 + i * STEP_X, 60 + (top - number) * STEP_Y)
          for number, row in rows.items() for i, m in enumerate(row)}
    out = [f'<text class="title" x="{left}" y="32">{title}</text>']
    for module, (x, y) in at.items():
        for other in sorted(reduced(edges)[module]):
            to_x, to_y = at[other]
            out.append(f'<path class="edge" d="M{x + WIDTH / 2:.0f},{y + HEIGHT} C{x + WIDTH / 2:.0f},'
                       f'{y + HEIGHT + 26} {to_x + WIDTH / 2:.0f},{to_y - 26} {to_x + WIDTH / 2:.0f},{to_y}"/>')
    for module, (x, y) in at.items():
        out.append(f'<rect x="{x:.0f}" y="{y:.0f}" width="{WIDTH}" height="{HEIGHT}" rx="4"/>'
                   f'<text x="{x + WIDTH / 2:.0f}" y="{y + 17:.0f}">{module}</text>'
                   f'<text class="lines" x="{x + WIDTH / 2:.0f}" y="{y + 32:.0f}">{lines[module]} lines</text>')
    return out, widest * STEP_X, 60 + top * STEP_Y


def main():
    before, width_before, height_before = draw("Before", *read(sources_before()), MARGIN)
    now, width_now, height_now = draw("Now", *read(sources_now()), MARGIN + width_before + 60)
    width, height = width_before + width_now + 60 + 2 * MARGIN, max(height_before, height_now)
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif">\n'
          "<style>text{font-size:13px;text-anchor:middle;fill:#222}.title{font-size:18px;text-anchor:start}"
          ".lines{font-size:10px;fill:#666}rect{fill:#eef3f8;stroke:#5b7a99}"
          ".edge{fill:none;stroke:#8aa;stroke-width:1;opacity:.7}</style>\n"
          f'<rect width="{width}" height="{height}" style="fill:#fff;stroke:none"/>')
    print("\n".join(before + now))
    print("</svg>")


if __name__ == "__main__":
    main()
