# SPDX-License-Identifier: MIT
"""tools/fleet in parts: cases.py reads the table, one_case.py does a case, engines.py runs many of it, rollup.py makes the
Parquet table of the results, drift.py the trend of a rig, page.py the page, progress.py how far it is; run.py puts them
together."""
