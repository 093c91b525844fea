#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compares the public declarations of the installed headers with the list in public_api.txt.

    public_api.py [--update]

A difference is a change of the interface that others compile against: update the list by --update, and describe the
change in CHANGELOG.md. Doxygen reads the headers; versions print declarations differently, so one is required.
Exit status: 0 equal or updated, 1 different, 77 another or no doxygen.
"""
import difflib
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIST = pathlib.Path(__file__).with_name("public_api.txt")
DOXYGEN = "1.9.4"
MODULES = ["core", "model", "estimator", "controller", "diagnosis", "drivers", "io", "rig", "nodes"]


def read_declarations(folder):
    """Returns the public declarations as lines of text: each header, then indented what it declares."""
    settings = {"OUTPUT_DIRECTORY": folder, "INPUT": " ".join(f"{module}/include" for module in MODULES),
                "FILE_PATTERNS": "*.hpp", "RECURSIVE": "YES", "EXTRACT_ALL": "YES", "GENERATE_XML": "YES",
                "GENERATE_HTML": "NO", "GENERATE_LATEX": "NO", "QUIET": "YES", "WARNINGS": "NO",
                "XML_PROGRAMLISTING": "NO", "BUILTIN_STL_SUPPORT": "YES", "WARN_IF_DOC_ERROR": "NO",
                "WARN_IF_UNDOCUMENTED": "NO", "WARN_IF_INCOMPLETE_DOC": "NO"}
    subprocess.run(["doxygen", "-"], input="".join(f"{key} = {value}\n" for key, value in settings.items()),
                   text=True, cwd=ROOT, check=True)
    declared = set()  # header, declaration
    for file in pathlib.Path(folder, "xml").glob("*.xml"):
        for compound in ET.parse(file).getroot().iter("compounddef"):
            if compound.get("kind") not in ("class", "struct", "union", "namespace"):
                continue
            name = compound.findtext("compoundname")
            if not name.startswith("bevel") or "anonymous" in name or "@" in name:
                continue
            if compound.get("kind") != "namespace":
                place = compound.find("location").get("file")
                bases = ", ".join(base.text for base in compound.iter("basecompoundref"))
                declared.add((place, f"{compound.get('kind')} {name}" + (f" : {bases}" if bases else "")))
            for member in compound.iter("memberdef"):
                if member.get("prot") not in ("public", "protected") or member.get("kind") == "friend":
                    continue
                text = (member.findtext("definition") or "") + (member.findtext("argsstring") or "")
                if member.get("kind") == "enum":
                    values = ", ".join(v.findtext("name") + (v.findtext("initializer") or "")
                                       for v in member.iter("enumvalue"))
                    text = f"enum {name}::{member.findtext('name')} {{{values}}}"
                declared.add((member.find("location").get("file"), text))
    lines, header = [], None
    for place, text in sorted(declared):
        if place != header:
            header = place
            lines.append(re.sub(r"^.*/include/", "", header))
        lines.append("  " + re.sub(r"\s+", " ", text.replace("bevel::", "")))
    return lines


def main():
    found = shutil.which("doxygen") and subprocess.run(["doxygen", "--version"], capture_output=True, text=True).stdout
    if not found or not found.startswith(DOXYGEN):
        print(f"public_api: doxygen is {(found or 'missing').strip()}; required: {DOXYGEN} (Debian 12)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        now = read_declarations(folder)
    if not now:
        print("public_api: doxygen found no declaration")
        return 1
    if "--update" in sys.argv[1:]:
        LIST.write_text("\n".join(now) + "\n")
        print(f"{LIST.relative_to(ROOT)}: {len(now)} declarations")
        return 0
    before = LIST.read_text().splitlines()
    changes = [line for line in difflib.unified_diff(before, now, "public_api.txt", "headers", lineterm="", n=0)]
    print("\n".join(changes) if changes else f"{len(now)} declarations, as listed")
    if changes:
        print("The public interface has changed: run tests/headers/public_api.py --update and describe it in CHANGELOG.md")
    return 1 if changes else 0


if __name__ == "__main__":
    sys.exit(main())
