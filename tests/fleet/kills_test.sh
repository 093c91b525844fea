#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# kills_test.sh SOURCE_DIR PYTHON: a fleet of six whose processes are killed, small enough for every test run.
set -euo pipefail
source=$1 python=$2
[ -e "$source/.deps/fleet/snakemake" ] || { echo "skipped: no Snakemake; tools/setup --fleet gets it"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$python" "$source/tests/fleet/kills.py" --out "$work/kills" --cases 6 --stand-in --kills 2 --every-s 0.3 --seed 1
