# SPDX-License-Identifier: MIT
"""Tables and picture of a comparison, from its JSON.

page.py RESULT.json PAGE.md puts them between the page's markers and next to it.
"""
import html
import json
import math
import pathlib
import statistics
import sys

BEGIN, END = "<!-- tables: written by tests/peers/compare -->", "<!-- end of tables -->"
METHODS = {
    "model refitted": "model, refitted",
    "sindy least": "PySINDy, least error",
    "sindy sparse": "PySINDy, 1-SE rule",
    "gp": "Gaussian process",
    "bic white": "BIC, white noise",
    "bic AR(1)": "BIC, AR(1) noise",
    "bevel-diagnose": "bevel-diagnose",
}
NAMING = ("bic white", "bic AR(1)", "bevel-diagnose")  # name causes; the others name terms, or nothing
COLOURS = {"model refitted": "#999999", "sindy least": "#e69f00", "sindy sparse": "#b57a00", "gp": "#56b4e9",
           "bic white": "#cc79a7", "bic AR(1)": "#7b3294", "bevel-diagnose": "#009e73"}  # fmt: skip


def table(header, rows):
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


def number(x, digits):
    return "-" if x is None or not math.isfinite(x) else f"{x:.{digits}f}"


def used(result):
    return [m for m in METHODS if all(m in row["methods"] for row in result["cases"])]


def summary(result):
    rows = []
    known = [row for row in result["cases"] if "truth" in row]
    nulls = [row for row in known if not row["truth"]]
    for method in used(result):
        of = [row["methods"][method] for row in result["cases"]]
        chi2 = [m["chi2_per_reading"] if m["chi2_per_reading"] is not None else math.inf for m in of]
        exact = sum(row["methods"][method].get("exact", False) for row in known)
        alarms = sum(row["methods"][method].get("false_alarm", False) for row in nulls)
        rows.append([METHODS[method], f"{exact} of {len(known)}" if known and method in NAMING else "names no cause",
                     f"{alarms} of {len(nulls)}" if nulls and method != "model refitted" else "-",
                     number(statistics.median(m["rmse_mm"] for m in of), 3), number(statistics.median(chi2), 3),
                     number(max(chi2), 2), number(statistics.median(m["seconds"] for m in of), 1),
                     number(max(m["seconds"] for m in of), 1)])  # fmt: skip
    return table(["", "exact set", "false alarms", "held-out RMSE mm, median", "held-out chi2, median", "chi2, worst",
                  "s, median", "s, longest"], rows)  # fmt: skip


def held_out(result):
    methods = used(result)
    rows = []
    for row in result["cases"]:
        cells = [f"{number(m['rmse_mm'], 3)} / {number(m['chi2_per_reading'], 2)}"
                 for m in (row["methods"][name] for name in methods)]  # fmt: skip
        rows.append([row["case"], "+".join(row.get("truth", ["?"])) or "nothing", *cells])
    return table(["case", "left out", *(METHODS[m] for m in methods)], rows)


def named(row, method):
    m = row["methods"].get(method)
    if m is None:
        return "-"
    if method.startswith("sindy"):
        count = len(m["names"])
        return f"{count} terms; {m['names'][0]}" if count > 1 else m["names"][0] if count else "no term"
    if method == "gp":
        return f"{'; '.join(m['most_relevant'])} ({100 * m['sure_share']:.0f} %)"
    text = "+".join(m["names"]) or "nothing"
    return text if m.get("exact", True) else f"**{text}**"


def names(result):
    methods = [m for m in used(result) if m != "model refitted"]
    return table(["case", "left out", *(METHODS[m] for m in methods)],
                 [[row["case"], "+".join(row.get("truth", ["?"])) or "nothing", *(named(row, m) for m in methods)]
                  for row in result["cases"]])  # fmt: skip


def seconds(result):
    methods = [m for m in used(result) if m not in ("model refitted", "sindy sparse")]
    rows = [[row["case"], *(number(row["methods"][m]["seconds"], 1) for m in methods)] for row in result["cases"]]
    return table(["case", *(METHODS[m].removesuffix(", least error") for m in methods)], rows)


def tables(result):
    return "\n\n".join(("### Summary", summary(result), "### Held-out error, RMSE in mm / chi2 per reading",
                        held_out(result), "### What each names", names(result), "### Seconds of one processor",
                        seconds(result)))  # fmt: skip


def cross(x, y, colour):
    return f'<path d="M{x - 4:.1f} {y - 4:.1f}l8 8m0 -8l-8 8" stroke="{colour}" stroke-width="2.5"/>'


def picture(result):
    """A row per case: held-out chi2 per reading, logarithmic; a cross where the wrong cause is named."""
    methods = used(result)
    left, top, wide, high = 250, 64, 640, 40
    chi2 = [row["methods"][m]["chi2_per_reading"] for row in result["cases"] for m in methods]
    finite = [c for c in chi2 if c is not None and math.isfinite(c)]
    low, most = math.log10(0.9), math.log10(max(finite) * 1.15)
    cut = math.log10(max(finite))

    def x(value):
        log = cut if value is None or not math.isfinite(value) else math.log10(max(value, 0.9))
        return left + wide * (log - low) / (most - low)

    height = top + high * len(result["cases"]) + 44
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + wide + 20} {height}" '
           f'font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="white"/>']  # fmt: skip
    for i, method in enumerate(methods):
        at_x, at_y = 12 + 225 * (i % 4), 18 + 20 * (i // 4)
        out.append(f'<circle cx="{at_x}" cy="{at_y - 4}" r="5" fill="{COLOURS[method]}"/>'
                   f'<text x="{at_x + 10}" y="{at_y}">{html.escape(METHODS[method])}</text>')  # fmt: skip
    at_x, at_y = 12 + 225 * 3, 38
    out.append(f'{cross(at_x, at_y - 4, "black")}<text x="{at_x + 10}" y="{at_y}">as a cross: wrong cause named</text>')
    bottom = top + high * len(result["cases"])
    for tick in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000):
        if math.log10(tick) > most:
            break
        out.append(f'<line x1="{x(tick):.1f}" x2="{x(tick):.1f}" y1="{top - 8}" y2="{bottom}" stroke="#ddd"/>'
                   f'<text x="{x(tick):.1f}" y="{bottom + 16}" text-anchor="middle">{tick}</text>')  # fmt: skip
    out.append(f'<text x="{left + wide / 2}" y="{bottom + 36}" text-anchor="middle">held-out chi2 per reading '
               f'(1 is the noise floor)</text>')  # fmt: skip
    for i, row in enumerate(result["cases"]):
        y = top + high * i + high / 2
        label = f"{row['case']} {'+'.join(row.get('truth', [])) or 'nothing'}"
        out.append(f'<text x="{left - 14}" y="{y + 4}" text-anchor="end">{html.escape(label)}</text>'
                   f'<line x1="{left}" x2="{left + wide}" y1="{y}" y2="{y}" stroke="#f2f2f2"/>')  # fmt: skip
        for place, method in enumerate(methods):
            at = row["methods"][method]
            cx, cy = x(at["chi2_per_reading"]), y + (place - (len(methods) - 1) / 2) * 5
            if at.get("exact") is False:
                out.append(cross(cx, cy, COLOURS[method]))
            else:
                out.append(f'<circle cx="{cx:.1f}" cy="{cy:.1f}" r="3.5" fill="{COLOURS[method]}"/>')
    return "\n".join([*out, "</svg>"]) + "\n"


def write(path, result):
    text = path.read_text()
    if BEGIN not in text or END not in text:
        sys.exit(f"compare: {path} lacks the lines '{BEGIN}' and '{END}'")
    head, rest = text.split(BEGIN)
    path.write_text(f"{head}{BEGIN}\n\n{tables(result)}\n\n{END}{rest.split(END)[1]}")
    path.with_suffix(".svg").write_text(picture(result))
    path.with_suffix(".json").write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    write(pathlib.Path(sys.argv[2]), json.loads(pathlib.Path(sys.argv[1]).read_text()))
