# SPDX-License-Identifier: MIT
"""A row a case, of its verdict.json and of how it was made; and the rows as a Parquet file."""
import json
import math
import os
import tempfile

FIT = {"as_it_stands": "held_out_as_it_stands_mm", "before": "held_out_before_mm", "after": "held_out_after_mm",
       "noise_floor": "held_out_noise_mm"}


NOT_DONE = "not done yet"


def rows(out, found):
    """Of all cases, in the order of rig and date; of those without a result, `fault` says why."""
    return sorted((row_of(out, case) for case in found), key=lambda row: (row["rig"], row["date"], row["case"]))


def row_of(out, case):
    row = {name: None for name in schema().names}
    row.update(case=case.name, rig=case.rig, date=case.date, key=case.key, effects=[])
    folder = out / "results" / case.key
    if not folder.exists():
        row["fault"] = fault_of(out, case.key)
        return row
    verdict = json.loads((folder / "verdict.json").read_text(encoding="utf-8"))
    made = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    row.update(verdict=verdict["verdict"], sentence=verdict.get("sentence"), effects=effects_of(verdict),
               exit_status=made["status"], seconds=made["seconds"], cpu_s=made["cpu_s"], machine=made["machine"],
               program_sha256=made["program_sha256"], model_sha256=made["model"][1],
               logs=[{"name": name, "sha256": digest} for name, digest in made["logs"]])
    needle = verdict.get("needle", {}).get("after", {})
    for name, sd in (("curvature_per_mm", "curvature_sd_per_mm"), ("lambda1_per_rad", "lambda1_sd_per_rad"),
                     ("lambda2", "lambda2_sd")):
        figure = needle.get(name, {})
        row[name], row[sd] = figure.get("value"), figure.get("std_error")
    row["readings"] = verdict.get("measurements", {}).get("used")
    row["outliers"] = verdict.get("measurements", {}).get("outliers")
    row["noise_mm"], row["noise_sd_mm"] = noise_of(verdict["noise"], row["readings"])
    for which, name in FIT.items():
        row[name] = verdict["fit"].get(which, {}).get("rmse_mm")
    return row


def fault_of(out, key):
    try:
        return json.loads((out / "refused" / f"{key}.json").read_text(encoding="utf-8"))["fault"]
    except (OSError, ValueError, KeyError):
        return NOT_DONE


def effects_of(verdict):
    """A line a parameter; effects whose parameters are all of single recordings have one line without."""
    lines = []
    for effect in [*verdict["effects"], *verdict.get("changes", [])]:
        known = {"effect": effect["name"], "probability": effect["probability"]}
        for name, figure in effect["parameters"].items():
            low, high = figure["ci95"]
            lines.append({**known, "parameter": name, "value": figure["value"], "std_error": figure["std_error"],
                          "ci95_low": low, "ci95_high": high})
        if not effect["parameters"]:
            lines.append(known)
    return lines


def noise_of(noise, readings):
    """Root mean square of the channels in mm, and its standard deviation. Of n readings with correlation r between
    neighbours, sigma has the relative deviation sqrt((1 + r^2) / (1 - r^2) / (2 n)) (Bartlett; Priestley, Spectral Analysis
    and Time Series, 5.3), and the mean of m channels one smaller by sqrt(m)."""
    units = noise.get("units", ["mm"] * len(noise["sigma_mm"]))
    squares = [sigma**2 for sigma, unit in zip(noise["sigma_mm"], units) if unit == "mm" and sigma is not None]
    if not squares:
        return None, None
    sigma = math.sqrt(sum(squares) / len(squares))
    r2 = (noise.get("ar1") or 0.0)**2
    if not readings or r2 >= 1:
        return sigma, None
    return sigma, sigma * math.sqrt((1 + r2) / (1 - r2) / (2 * readings * len(squares)))


def schema():
    import pyarrow as pa

    text, figure, whole = pa.string(), pa.float64(), pa.int64()
    effect = pa.struct([("effect", text), ("probability", figure), ("parameter", text), ("value", figure),
                        ("std_error", figure), ("ci95_low", figure), ("ci95_high", figure)])
    columns = [("case", text), ("rig", text), ("date", pa.timestamp("us")), ("verdict", text), ("sentence", text),
               ("effects", pa.list_(effect)), ("curvature_per_mm", figure), ("curvature_sd_per_mm", figure),
               ("lambda1_per_rad", figure), ("lambda1_sd_per_rad", figure), ("lambda2", figure), ("lambda2_sd", figure),
               ("noise_mm", figure), ("noise_sd_mm", figure), *((name, figure) for name in FIT.values()),
               ("readings", whole), ("outliers", whole), ("exit_status", whole), ("fault", text), ("seconds", figure),
               ("cpu_s", figure), ("machine", text), ("key", text), ("program_sha256", text), ("model_sha256", text),
               ("logs", pa.list_(pa.struct([("name", text), ("sha256", text)])))]
    return pa.schema(columns)


def write_parquet(path, table):
    """Whole, or as it was before."""
    import pyarrow as pa
    import pyarrow.parquet

    handle, name = tempfile.mkstemp(prefix=".unfinished-", dir=path.parent)
    os.close(handle)
    pa.parquet.write_table(pa.Table.from_pylist(table, schema()), name)
    os.chmod(name, 0o644)
    os.replace(name, path)
