#!/usr/bin/env bash
# example_test.sh BIN_DIR SOURCE_DIR PYTHON: every command of examples/README.md, as it stands there, in a folder of its
# own; and what the page says of the verdict, against the verdict.
set -euo pipefail
bin=$1 source=$2 python=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/build"
ln -s "$bin" "$work/build/bin"
ln -s "$source/examples" "$work/examples"
cd "$work"
count=0
while IFS= read -r command; do
  echo "\$ $command"
  bash -ec "$command" || { echo "FAILED: '$command': status $?"; exit 1; }
  count=$((count + 1))
done < <(sed -n 's/^    \(build\/bin\/.*\)/\1/p' "$source/examples/README.md")
[ $count -ge 3 ] || { echo "FAILED: $count commands in examples/README.md"; exit 1; }
"$python" - "$source" <<'EOF'
import json, re, sys
verdict = json.load(open("out/stick_slip/verdict.json"))
page = open(sys.argv[1] + "/examples/README.md").read()
assert [e["name"] for e in verdict["effects"]] == ["stick_slip"], verdict["effects"]
jump = verdict["effects"][0]["parameters"]["jump_mm"]
concealed = float(re.search(r"([\d.]+) mm was\s+concealed", page).group(1))
assert jump["ci95"][0] - 5e-5 <= concealed <= jump["ci95"][1] + 5e-5, (jump, concealed)  # the page rounds
before, after = (verdict["fit"][w]["chi2_per_dof"] for w in ("before", "after"))
assert (f"{before:.1f}", f"{after:.1f}") == ("2.2", "1.0"), (before, after)
# By a jump at most, all else as found; and steered, where it rests within a jump of the target.
assert 0 < verdict["effects"][0]["moved_at_depth_mm"] <= 0.88, verdict["effects"]
steered = verdict["steered"]
for believed in ("as_it_stands", "found"):
    figures = steered[believed]
    assert figures["arrived"] == steered["targets"] == 8, steered
    assert 0 < figures["median_mm"] <= figures["worst_mm"] < 1, steered
assert "stick_slip" in open(sys.argv[1] + "/examples/stick_slip/report.html").read()
EOF
echo "ok: $count commands"
