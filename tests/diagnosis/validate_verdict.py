#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""validate_verdict.py VERDICT...: each against docs/verdict.schema.json; exit status 1 and the first fault if one fails."""
import json
import pathlib
import sys

import jsonschema


def refuse_constant(name):
    raise ValueError(f"{name} is no JSON")


schema = json.loads((pathlib.Path(__file__).parents[2] / "docs/verdict.schema.json").read_text())
jsonschema.Draft7Validator.check_schema(schema)
validator = jsonschema.Draft7Validator(schema)
bad = False
for path in sys.argv[1:]:
    verdict = json.loads(pathlib.Path(path).read_text(), parse_constant=refuse_constant)
    for error in sorted(validator.iter_errors(verdict), key=lambda e: list(map(str, e.path))):
        print(f"{path}: {'.'.join(map(str, error.path)) or 'top'}: {error.message}", file=sys.stderr)
        bad = True
sys.exit(bad)
