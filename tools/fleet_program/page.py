# SPDX-License-Identifier: MIT
"""The page of a fleet: verdicts, and by rig what drifts. One file beside the results; it needs no network."""
import collections
import datetime
import html as escaping
import math

from . import drift

STYLE = """
:root { --ground: #fff; --ink: #222; --soft: #666; --line: #ddd; --faint: #aaa; --blue: #1f6fb2; --orange: #d1622b;
        --warning: #fbf6e8; --bad: #fbeeec; }
@media screen and (prefers-color-scheme: dark) {
  :root { --ground: #14171b; --ink: #e6e9ed; --soft: #9aa3ae; --line: #343b45; --faint: #5c6570; --blue: #62aef0;
          --orange: #f0875a; --warning: #2b2613; --bad: #301a18; color-scheme: dark; } }
body { font: 16px/1.5 system-ui, "Helvetica Neue", Helvetica, Arial, sans-serif; color: var(--ink);
       max-width: 72rem; margin: 2.5rem auto; padding: 0 1.2rem; background: var(--ground); }
a { color: var(--blue); }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 1.2rem; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 .6rem; padding-bottom: .25rem; border-bottom: 1px solid var(--line); }
caption, .note { color: var(--soft); font-size: .88rem; text-align: left; }
caption { caption-side: bottom; padding-top: .4rem; }
table { border-collapse: collapse; margin: 1rem 0; font-size: .88rem; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .7rem; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
th { border-bottom: 2px solid var(--faint); font-weight: 600; } .number { text-align: right; }
.number, .date { white-space: nowrap; }
.facts { display: flex; flex-wrap: wrap; gap: .7rem; margin: 1.1rem 0; }
.facts div { flex: 1 1 6.5rem; border: 1px solid var(--line); border-radius: 6px; padding: .55rem .8rem; }
.facts span { display: block; color: var(--soft); font-size: .82rem; } .facts b { font-size: 1.12rem; font-weight: 600; }
.panels { display: grid; grid-template-columns: repeat(auto-fill, minmax(19rem, 1fr)); gap: .6rem 1.2rem; }
.panels svg { width: 100%; height: auto; } .drifts { background: var(--warning); } .bad { background: var(--bad); }
@media print { body { margin: 0; max-width: none; } svg, table { break-inside: avoid; } }
"""
NEEDLE = (("k", "1/mm", "curvature_per_mm", "curvature_sd_per_mm"),
          ("lambda1", "1/rad", "lambda1_per_rad", "lambda1_sd_per_rad"), ("lambda2", "", "lambda2", "lambda2_sd"),
          ("noise", "mm", "noise_mm", "noise_sd_mm"))
UNITS = ("per_mm", "per_rad", "mm_per_s", "rad_per_s", "mm", "rad", "s")  # with which a parameter's name may end
Z95 = 1.96
MARKED_SD = 3.0
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 340, 190, 58, 8, 26, 26


def text(value):
    return escaping.escape(str(value))


def figure(value, digits=4):
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}g}".replace("e-0", "e-").replace("e+0", "e")


def days_of(row):
    return (row["date"] - datetime.datetime(1970, 1, 1)).total_seconds() / 86400


def name_and_unit(parameter):
    """Of a parameter of a verdict: loss_per_mm is a loss in 1/mm."""
    unit = next((unit for unit in UNITS if parameter.endswith("_" + unit)), "")
    name = parameter.removesuffix("_" + unit) if unit else parameter
    return name, unit.replace("_per_", "/").replace("per_", "1/")


def size_of(line):
    """What was found in a case, and its size: one effect, one parameter."""
    if not line.get("parameter"):
        return line["effect"]
    name, unit = name_and_unit(line["parameter"])
    return f"{line['effect']}: {name} {figure(line['value'])} ± {figure(line['std_error'], 2)} {unit}".rstrip()


def curves_of(rows):
    """What is drawn of a rig: (title, unit, [(days, value, sd)]): the needle, the noise, then each parameter found."""
    done = [row for row in rows if row["verdict"] is not None]
    curves = [(title, unit, [(days_of(row), row[name], row[sd]) for row in done if row[name] is not None])
              for title, unit, name, sd in NEEDLE]
    found = collections.defaultdict(list)
    for row in done:
        for line in row["effects"]:
            if line.get("parameter") and line["value"] is not None:
                found[line["effect"], line["parameter"]].append((days_of(row), line["value"], line["std_error"]))
    for (effect, parameter), points in sorted(found.items()):
        name, unit = name_and_unit(parameter)
        curves.append((f"{effect}: {name}, in {len(points)} of {len(done)}", unit, points))
    return [curve for curve in curves if curve[2]]


def svg(title, unit, points):
    """Values with their 95 % errors over the date, and the line of drift.trend()."""
    days = [t for t, _, _ in points]
    ends = [y + side * Z95 * (s or 0) for _, y, s in points for side in (-1, 1)]
    low, high, first, last = min(ends), max(ends), min(days), max(days)
    margin = 0.06 * (high - low) or abs(high) * 0.1 or 1.0
    low, high = low - margin, high + margin
    span = last - first or 1.0

    def x(t):
        return LEFT + 8 + (t - first if last > first else 0.5) / span * (WIDTH - LEFT - RIGHT - 16)

    def y(value):
        return TOP + (high - value) / (high - low) * (HEIGHT - TOP - BOTTOM)

    digits = 3 + max(0, int(math.log10(max(abs(low), abs(high)) / (high - low))))
    marks = []
    for share in (0.1, 0.5, 0.9):
        value = low + share * (high - low)
        marks.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(value):.1f}" y2="{y(value):.1f}" style="stroke:var(--line)"/>'
                     f'<text x="{LEFT - 5}" y="{y(value) + 3.5:.1f}" text-anchor="end">{figure(value, digits)}</text>')
    for t, anchor in ((first, "start"), (last, "end"))[: 2 if last > first else 1]:
        when = datetime.datetime(1970, 1, 1) + datetime.timedelta(days=t)
        label = when.strftime("%Y-%m-%d" if span > 2 else "%Y-%m-%d %H:%M")
        marks.append(f'<text x="{LEFT if anchor == "start" else WIDTH - RIGHT}" y="{HEIGHT - 8}" '
                     f'text-anchor="{anchor}">{label}</text>')
    if line := drift.trend(*zip(*points)):
        at = [line.mean + line.per_day * (t - line.at_mean_days) for t in (first, last)]
        marks.append(f'<line x1="{x(first):.1f}" x2="{x(last):.1f}" y1="{y(at[0]):.1f}" y2="{y(at[1]):.1f}" '
                     'stroke-width="1.5" style="stroke:var(--orange)"/>')
    for t, value, sd in points:
        half = Z95 * (sd or 0)
        marks.append(f'<line x1="{x(t):.1f}" x2="{x(t):.1f}" y1="{y(value - half):.1f}" y2="{y(value + half):.1f}" '
                     f'stroke-opacity=".45" style="stroke:var(--blue)"/>'
                     f'<circle cx="{x(t):.1f}" cy="{y(value):.1f}" r="2.6" style="fill:var(--blue)"/>')
    return (f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" font-size="11" font-family="sans-serif" style="fill:var(--ink)" role="img">'
            f'<title>{text(title)} over the date</title><text x="{LEFT}" y="15" font-weight="600">{text(title)}'
            f'{" (" + unit + ")" if unit else ""}</text><rect x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" '
            f'height="{HEIGHT - TOP - BOTTOM}" style="fill:none;stroke:var(--line)"/>{"".join(marks)}</svg>')


def drift_table(curves):
    lines = []
    for title, unit, points in curves:
        line = drift.trend(*zip(*points))
        if not line:
            lines.append(f"<tr><td>{text(title)}<td>{unit}<td class=number>{len(points)}" + 4 * "<td class=number>–")
            continue
        ratio = line.per_day / line.per_day_sd
        marked = " class=drifts" if abs(ratio) > MARKED_SD else ""
        lines.append(f"<tr{marked}><td>{text(title)}<td>{unit}<td class=number>{line.count}<td class=number>"
                     f"{figure(line.mean)}<td class=number>{figure(line.per_day, 3)} ± {figure(line.per_day_sd, 2)}"
                     f"<td class=number>{ratio:.1f}<td class=number>{line.chi2_per_dof:.2f}")
    return ("<table><tr><th>figure<th>unit<th>cases<th>mean<th>drift a day<th>drift / its sd<th>chi2/dof about the line"
            + "".join(lines) + "</table>")


def case_table(rows):
    lines = []
    for row in rows:
        date = row["date"].strftime("%Y-%m-%d %H:%M").removesuffix(" 00:00")
        if row["verdict"] is None:
            lines.append(f"<tr class=bad><td>{text(row['case'])}<td>{text(row['rig'])}<td class=date>{date}<td colspan=7>"
                         f"{text(row['fault'])}")
            continue
        sizes = "<br>".join(text(size_of(line)) for line in row["effects"])
        name = f'<a href="results/{row["key"]}/report.html">{text(row["case"])}</a>'
        verdict = row["verdict"].replace("-", " ") + (" (damaged recordings)" if row["exit_status"] == 3 else "")
        lines.append(
            f"<tr><td>{name}<td>{text(row['rig'])}<td class=date>{date}<td>{text(verdict)}<td>{sizes}"
            f"<td class=number>{figure(row['curvature_per_mm'])} ± {figure(row['curvature_sd_per_mm'], 2)}"
            f"<td class=number>{figure(row['noise_mm'], 3)}<td class=number>{figure(row['held_out_before_mm'], 3)}"
            f"<td class=number>{figure(row['held_out_after_mm'], 3)}<td class=number>{figure(row['seconds'], 3)}")
    return ("<table><tr><th>case<th>rig<th>date<th>verdict<th>effects, sizes<th>k, 1/mm<th>noise, mm<th>held out before, mm"
            "<th>after, mm<th>time, s" + "".join(lines) + "</table>")


def html(rows, title):
    counts = collections.Counter("could not be diagnosed" if row["verdict"] is None else row["verdict"].replace("-", " ")
                                 for row in rows)
    facts = "".join(f"<div><span>{text(name)}</span><b>{count}</b></div>" for name, count in sorted(counts.items()))
    rigs = collections.defaultdict(list)
    for row in rows:
        rigs[row["rig"]].append(row)
    parts = []
    for rig, own in rigs.items():
        curves = curves_of(own)
        panels = "".join(svg(*curve) for curve in curves)
        parts.append(f"<h2>{text(rig)}: {len(own)} cases</h2><div class=panels>{panels}</div>{drift_table(curves)}")
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>Fleet {text(title)}</title>\n'
        f"<style>{STYLE}</style></head>\n<body><h1>Fleet {text(title)}: {len(rows)} cases of {len(rigs)} rigs</h1>"
        f"<div class=facts>{facts}</div>\n<p class=note>Points: a case each, with the 95 % interval of its own error. Orange: "
        "a straight line by weighted least squares; the drift's standard deviation counts what cases differ by beyond their "
        f"errors. Marked is a drift of more than {MARKED_SD:g} of its standard deviations; by chance alone about 1 in 400 "
        "is, where there are many cases. An effect's size is known only where it was found, so its drift is one of those "
        "cases alone.</p>\n" + "\n".join(parts) + f"\n<h2>Verdicts</h2>{case_table(rows)}\n"
        "<p class=note>Held out: rms error per axis of each recording predicted from the others, with the needle refitted "
        "and with what was found. All of it, with hashes, is in fleet.parquet.</p></body></html>\n")
