#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# page_test.sh FEEDER: what a browser shows of the live page. Status 77: skipped, for want of a browser; it says so.
set -uo pipefail
feeder=$1
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome) ||
  { echo "SKIPPED: no Chromium here (Debian: chromium): the page was not opened in a browser"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkfifo "$work/input"
"$feeder" <"$work/input" >"$work/address" & pid=$!
exec 3>"$work/input"  # the feeder ends when this closes
for _ in $(seq 50); do [ -s "$work/address" ] && break; sleep 0.1; done
address=$(sed 's/^watch at //' "$work/address")
# The browser's virtual time may run out before the picture is decoded, which it does not wait for: then once more.
for _ in $(seq 10); do
  HOME=$work timeout 90 "$browser" --headless --no-sandbox --disable-gpu --window-size=1400,1200 --user-data-dir="$work/browser" \
    --virtual-time-budget=1500 --dump-dom "$address?still" >"$work/page.html" 2>"$work/said"
  grep -q 'data-shown=' "$work/page.html" && ! grep -q '<body class="waiting">' "$work/page.html" && break
done
exec 3>&-
wait $pid || { echo "FAILED: the feeder ended with status $?"; exit 1; }
expect() { grep -qE -- "$1" "$work/page.html" || { echo "FAILED: the page has nothing of '$1'"; sed -n '/<body/,/<script/p' "$work/page.html"; exit 1; }; }
expect '<body class="">'                                            # heard something, not cut off
expect 'id="state" class="badge bad">stopped<'
expect 'bevel-controller: measurements stale &lt;b&gt;0.25 s'          # text is text
expect 'class="fact"><b>[0-9.]+ mm</b><span>to the target · tolerance 1.00 mm'
expect '<b>4.70 ± 1.00</b><span>k · 1e-3/mm, radius 213 mm'
expect '<tr><td>0</td><td class="good">ok</td><td>–</td>'             # camera 0 does not see x
expect '<tr class="stale"><td>1</td>'                                 # camera 1 fell silent
expect 'class="u-title">insertion rate \(mm/s\)'
expect '<figure class="(old)?" data-shown="160 x 120"><canvas aria-label="Picture of camera 0" width="160" height="120"></canvas><figcaption>camera 0 · tip at 100, 40 px · [0-9.]+ s old<'
expect 'id="mode" class="badge quiet">live<'
echo "ok: $(wc -c <"$work/page.html") bytes of page"
