#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws diagnosis-rooms.svg: the files of the diagnosis (header and source as one) with their lines, each above what it
includes, as they were before the one-posterior method and as they are now.

    python3 docs/pictures/draw_includes.py > docs/pictures/diagnosis-rooms.svg
"""
import re
import subprocess

BEFORE = "6301e7e9cd"
FILL = {"diagnosis/inference": "i", "diagnosis/needle": "n", "diagnosis/mismatch": "m", "diagnosis": "m"}
STEP_X, STEP_Y, WIDTH, HEIGHT = 126, 64, 118, 34


def git(*arguments):
    return subprocess.run(["git", *arguments], check=True, capture_output=True, text=True).stdout


def read(revision, folders):
    """Per file without its ending: folder, lines, included files. Public headers are in include/bevel/diagnosis, all other
    files in src; older revisions have both in one folder."""
    files = {}
    for path in git("ls-tree", "-r", "--name-only", revision, "diagnosis").split():
        match = re.fullmatch(r"(diagnosis)/(?:src/|include/bevel/diagnosis/)?(?:(.*)/)?(\w+)\.[ch]pp", path)
        folder = match and "/".join(part for part in match.group(1, 2) if part)
        if folder not in folders:
            continue
        text = git("show", f"{revision}:{path}")
        name = f"{folder}/{match[3]}"
        _, lines, included = files.setdefault(name, (folder, 0, set()))
        included |= set(re.findall(r'#include "(diagnosis/[\w/]+)\.hpp"', text))
        included |= set(re.findall(r"#include <bevel/(diagnosis/[\w/]+)\.hpp>", text))
        included |= {"diagnosis/" + private for private in re.findall(r'#include "([\w/]+)\.hpp"', text)}
        files[name] = (folder, lines + text.count("\n"), included)
    return {name: (folder, lines, {i for i in included if i in files and i != name})
            for name, (folder, lines, included) in files.items()}


def floors_of(files):
    """Each file one floor above the highest that it includes (a source may include what includes its header: such a
    way round is cut where it is met); within a floor, near those."""
    floor = {}

    def find(name, above):
        if name not in floor:
            below = [find(i, above | {name}) for i in sorted(files[name][2]) if i not in above]
            floor[name] = 1 + max(below, default=-1)
        return floor[name]

    for name in sorted(files):
        find(name, set())
    rows = [sorted(n for n in files if floor[n] == f) for f in range(max(floor.values()) + 1)]
    place = {}
    for _ in range(8):
        for f, row in enumerate(rows):
            def middle(name):
                beside = [place[i] for i in files[name][2] if i in place]
                beside += [place[n] for n in files if name in files[n][2] and n in place]
                return sum(beside) / len(beside) if beside else 0.5
            row.sort(key=middle)
            place.update({name: (i + 0.5) / len(row) for i, name in enumerate(row)})
    return rows


def draw(title, revision, folders, left, out):
    files = read(revision, folders)
    rows = floors_of(files)
    width = STEP_X * max(map(len, rows))
    at = {}
    for f, row in enumerate(rows):
        for i, name in enumerate(row):
            at[name] = (left + width * (i + 0.5) / len(row), 70 + STEP_Y * (len(rows) - 1 - f))
    lines = sum(one[1] for one in files.values())
    out.append(f'<text x="{left}" y="24" font-size="17" text-anchor="start">{title}: {len(files)} files, {lines} lines, '
               f'{len(rows)} floors</text>')
    for name, (_, _, included) in sorted(files.items()):
        for other in sorted(included):
            (x, y), (u, v) = at[name], at[other]
            out.append(f'<path d="M{x:.0f} {y + HEIGHT / 2:.0f} C{x:.0f} {y + 42:.0f} {u:.0f} {v - 42:.0f} {u:.0f} '
                       f'{v - HEIGHT / 2:.0f}" class="e"/>')
    for name, (folder, count, _) in sorted(files.items()):
        x, y = at[name]
        out.append(f'<rect x="{x - WIDTH / 2:.0f}" y="{y - HEIGHT / 2:.0f}" width="{WIDTH}" height="{HEIGHT}" rx="4" '
                   f'class="{FILL[folder]}"/><text x="{x:.0f}" y="{y - 1:.0f}" font-size="11">{name.split("/")[-1]}</text>'
                   f'<text x="{x:.0f}" y="{y + 12:.0f}" font-size="8" class="l">{count}</text>')
    return left + width, 70 + STEP_Y * len(rows)


def main():
    out = []
    right, _ = draw("Rules, before", BEFORE, ("diagnosis/mismatch",), 10, out)
    width, height = draw("One posterior", "HEAD", tuple(FILL), right + 60, out)
    for i, (mark, meaning) in enumerate((("i", "inference: the engine"), ("n", "needle: its client"),
                                         ("m", "mismatch: the verdict"))):
        x = right + 60 + 200 * i
        out.append(f'<rect x="{x}" y="{height}" width="14" height="14" class="{mark}"/>'
                   f'<text x="{x + 20}" y="{height + 12}" font-size="12" text-anchor="start">{meaning}</text>')
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width + 10:.0f} {height + 30}" font-family="sans-serif" '
          f'text-anchor="middle"><style>rect{{stroke:#445;stroke-width:.8}}.i{{fill:#dbe9f7}}.n{{fill:#e2f2dc}}'
          f'.m{{fill:#f7ead2}}.e{{fill:none;stroke:#8893a0;stroke-width:.7;opacity:.55}}.l{{fill:#667}}</style>'
          f'<rect width="{width + 10:.0f}" height="{height + 30}" style="fill:#fff;stroke:none"/>')
    print("\n".join(out) + "\n</svg>")


if __name__ == "__main__":
    main()
