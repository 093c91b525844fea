# SPDX-License-Identifier: MIT
"""browser_test.py WRITE_EXAMPLE: the example page (example_page.cpp) as a browser shows it: what is read off, what is
linked, what a zoom does, colours, paper, and a page without scripts. Status 77: skipped, for want of a browser."""
import os
import subprocess
import sys
import tempfile

from browser import Browser, find_chromium


def expect(condition, what):
    if not condition:
        raise AssertionError(what)


# In the page: where a value stands on the screen, what a legend says, whether a hair line is shown.
HELP = """
window.over = n => document.querySelector(`[data-figure="${n}"] .u-over`).getBoundingClientRect();
window.legend = n => Object.fromEntries([...document.querySelectorAll(`[data-figure="${n}"] .legend button`)]
  .map(b => [b.firstChild.nextSibling.textContent, b.querySelector('b').textContent]));
window.at = n => document.querySelector(`[data-figure="${n}"] .legend .at`).textContent;
window.hair = n => getComputedStyle(document.querySelector(`[data-figure="${n}"] .hair`)).display;
window.ticks = n => document.querySelector(`[data-figure="${n}"] .reset`).hidden;
"""


def near(text, value, by):
    return abs(float(text) - value) <= by


def test_reading_and_links(page):
    page.until("document.querySelectorAll('.drawn').length >= 5", "five figures drawn")
    box = page.evaluate("(({left, top, width, height}) => ({left, top, width, height}))(over(0))")
    x, y = box["left"] + 0.4 * box["width"], box["top"] + 0.5 * box["height"]
    page.mouse("Moved", x, y)
    page.until("at(0) !== '' && at(1) !== ''", "both panels say the instant")
    t = float(page.evaluate("at(0)").removeprefix("at "))
    expect(6 < t < 10, f"0.4 of 20 s is near 8 s, read {t}")
    expect(page.evaluate("at(1)") == page.evaluate("at(0)"), "the linked panel points at another instant")
    one, other = page.evaluate("legend(0)"), page.evaluate("legend(1)")
    expect(near(one["x"], 2 * t, 0.01), f"x is 2 t: {one} at {t}")
    expect(near(other["y"], 100 - t, 0.06), f"y is 100 - t: {other} at {t}")
    low, high = one["2 sigma"].split(" to ")
    expect(near(low, 2 * t - 1, 0.01) and near(high, 2 * t + 1, 0.01), f"the band: {one}")
    expect(page.evaluate("hair(0) + hair(1)") == "blockblock", "no hair lines")
    tip = page.evaluate("legend(2)")["tip <i>"]
    expect(near(tip.split(", ")[2].removesuffix(" mm"), 5 * t, 0.01), f"the path in space, z is 5 t: {tip}")
    # Away from the figures nothing is pointed at any more.
    page.mouse("Moved", 5, 5)
    page.until("at(0) === '' && at(1) === '' && legend(2)['tip <i>'] === ''", "what was pointed at is cleared")


def test_zoom(page):
    box = page.evaluate("(({left, top, width, height}) => ({left, top, width, height}))(over(0))")
    y = box["top"] + 0.5 * box["height"]
    page.drag(box["left"] + 0.25 * box["width"], y, box["left"] + 0.5 * box["width"], y)
    page.until("!ticks(0) && !ticks(1)", "both panels are zoomed")
    page.mouse("Moved", box["left"] + 2, y)
    page.until("at(1) !== ''", "an instant in the zoomed panels")
    left = float(page.evaluate("at(1)").removeprefix("at "))
    page.mouse("Moved", box["left"] + box["width"] - 2, y)
    page.until(f"at(1) !== 'at {left:g}'", "another instant")
    right = float(page.evaluate("at(1)").removeprefix("at "))
    expect(3.5 < left < 5.5 and 9 < right < 11, f"a quarter to a half of 20 s: {left} to {right}")
    page.evaluate("document.querySelector('[data-figure=\"1\"] .reset').click()")
    page.until("ticks(0) && ticks(1)", "both panels show the whole again")


def test_linked_by_reading(page):
    page.evaluate("document.querySelector('[data-figure=\"3\"]').scrollIntoView({block: 'center'})")
    box = page.evaluate("(({left, top, width, height}) => ({left, top, width, height}))(over(3))")
    # Reading 3 is at 1 of 0 to 19, with a residual of 0.3 in 0 to 1.9; each axis with 4 % of room.
    page.mouse("Moved", box["left"] + box["width"] * (1 + 0.76) / (19 * 1.08),
               box["top"] + box["height"] * (1 - (0.3 + 0.076) / (1.9 * 1.08)))
    page.until("at(3) === 'at 1' && at(4) === 'at -3'", "reading 3 in both panels")
    expect(page.evaluate("legend(3).residual + legend(4).residual") == "0.30.3", "its residual in both")


def test_hiding(page):
    page.evaluate("window.scrollTo(0, 0)")
    page.evaluate("document.querySelector('[data-figure=\"0\"] .legend button').click()")
    expect(page.evaluate("document.querySelector('[data-figure=\"0\"] .legend button').className") == "off", "not hidden")
    page.evaluate("document.querySelector('[data-figure=\"0\"] .legend button').click()")


def test_colours_and_paper(page):
    ground = "getComputedStyle(document.body).backgroundColor"
    # How light a canvas of a chart is where its line runs: another colour in the dark.
    ink = "(() => { const c = document.querySelector('[data-figure=\"1\"] canvas'); const k = document.createElement('canvas'); k.width = c.width; k.height = c.height; const x = k.getContext('2d', {willReadFrequently: true}); x.drawImage(c, 0, 0); const d = x.getImageData(0, 0, c.width, c.height).data; const seen = {}; for (let i = 0; i < d.length; i += 4) if (d[i + 3] === 255) seen[[d[i], d[i + 1], d[i + 2]]] = (seen[[d[i], d[i + 1], d[i + 2]]] || 0) + 1; return Object.entries(seen).sort((a, b) => b[1] - a[1]).map(e => e[0]).slice(0, 12).join(' '); })()"
    page.prefer("light")
    expect(page.evaluate(ground) == "rgb(255, 255, 255)", "light ground")
    page.until(ink + ".includes('31,111,178')", "the line in the light page's blue")
    page.prefer("dark")
    expect(page.evaluate(ground) == "rgb(20, 23, 27)", "dark ground")
    page.until(ink + ".includes('98,174,240')", "the line in the dark page's blue")
    page.prefer("dark", "print")
    expect(page.evaluate(ground) == "rgb(255, 255, 255)", "paper is white, whatever the screen")
    shown = "[...document.querySelectorAll('main > figure [data-figure]')].every(f => getComputedStyle(f.querySelector('.still')).display !== 'none' && (!f.querySelector('.live') || getComputedStyle(f.querySelector('.live')).display === 'none'))"
    expect(page.evaluate(shown), "on paper every figure is its still picture")
    page.prefer("light")


def test_fold(page):
    expect(page.evaluate("document.querySelector('[data-figure=\"5\"]').className") == "panel", "drawn while folded")
    page.evaluate("document.querySelector('details').open = true; document.querySelector('details').scrollIntoView()")
    page.until("document.querySelector('[data-figure=\"5\"]').className.includes('drawn')", "drawn when unfolded")


# In the page: how many pixels of the canvas, in the box of a reference's name, have a colour of the page's.
PIXELS = """
window.pixels = (n, name) => {
  const canvas = document.querySelector(`[data-figure="${n}"] canvas`), box = JSON.parse(canvas.dataset.labels)[0];
  const probe = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  probe.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
  probe.fillRect(0, 0, 1, 1);
  const ink = probe.getImageData(0, 0, 1, 1).data;
  probe.clearRect(0, 0, 300, 150);
  probe.drawImage(canvas, -Math.round(box.left), -Math.round(box.top));
  const seen = probe.getImageData(0, 0, box.right - box.left, box.bottom - box.top).data;
  let count = 0;
  for (let i = 0; i < seen.length; i += 4)
    if (seen[i + 3] > 128 && [0, 1, 2].every(j => Math.abs(seen[i + j] - ink[j]) < 40)) ++count;
  return count;
};
"""


def test_names_on_lines(page):
    page.evaluate(PIXELS)
    expect(page.evaluate("pixels(5, 'soft')") > 10, "the name of the line is not where it says")
    expect(page.evaluate("pixels(5, 'blue')") == 0, "the name of the line lies over the curve")


def test_quiet(page, address):
    expect(page.errors == [], f"scripts complain: {page.errors}")
    expect(page.requests == [address], f"the page asks for more than itself: {page.requests}")


def test_without_scripts(address):
    with Browser() as page:
        page.call("Emulation.setScriptExecutionDisabled", value=True)
        page.open(address)
        seen = "[...document.querySelectorAll('main > figure .still > svg')].map(s => s.getBoundingClientRect().height > 50)"
        expect(page.evaluate(seen) == [True] * 5, "without scripts every figure is its still picture")


def test_injected_script_does_not_run(address, folder):
    """Should a text ever come through unescaped, the page's policy still stops it."""
    with open(address.removeprefix("file://"), encoding="utf-8") as file:
        html = file.read().replace("</main>", "<script>document.title = 'run'</script><img src=x onerror=\"document.title = 'run'\"></main>")
    path = os.path.join(folder, "injected.html")
    with open(path, "w", encoding="utf-8") as file:
        file.write(html)
    with Browser() as page:
        page.open("file://" + path)
        page.until("document.querySelectorAll('.drawn').length >= 1", "the page's own script runs")
        expect(page.evaluate("document.title") == "Example <b>page</b>", "a foreign script ran")
        expect(any("Content Security Policy" in e for e in page.errors), f"nothing was refused: {page.errors}")


def main():
    if not find_chromium():
        print("SKIPPED: no Chromium here (Debian: chromium): the pages were not opened in a browser")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "example.html")
        subprocess.run([sys.argv[1], path], check=True)
        address = "file://" + path
        with Browser(width=1100, height=1400) as page:
            page.prefer("light")
            page.open(address)
            page.evaluate(HELP)
            for test in (test_reading_and_links, test_zoom, test_linked_by_reading, test_hiding, test_colours_and_paper, test_fold,
                         test_names_on_lines):
                test(page)
                print("ok:", test.__name__)
            test_quiet(page, address)
        test_without_scripts(address)
        test_injected_script_does_not_run(address, folder)
    print("ok: quiet, without scripts, injected script")
    return 0


if __name__ == "__main__":
    sys.exit(main())
