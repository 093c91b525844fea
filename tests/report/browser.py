# SPDX-License-Identifier: MIT
"""A page in headless Chromium, driven over the pipe of its DevTools protocol: no driver, no package, no port.

Errors of scripts, warnings of the content policy and everything that the page asks a network for are kept.
"""
import base64
import fcntl
import json
import os
import select
import shutil
import signal
import sys
import tempfile
import time


def find_chromium():
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if path := shutil.which(name):
            return path
    return None


class Browser:
    """One tab. Use as a context manager."""

    def __init__(self, width=1200, height=900, timeout_s=90):
        self.deadline = time.monotonic() + timeout_s
        self.folder = tempfile.mkdtemp()
        to_read, self.out = os.pipe()
        self.inp, to_write = os.pipe()
        # Chromium has the pipe at 3 and 4: first out of the way of those numbers.
        high = [fcntl.fcntl(fd, fcntl.F_DUPFD, 20) for fd in (to_read, to_write)]
        null = os.open(os.devnull, os.O_RDWR)
        actions = [(os.POSIX_SPAWN_DUP2, fd, at) for fd, at in ((null, 0), (null, 1), (null, 2), (high[0], 3), (high[1], 4))]
        arguments = [find_chromium(), "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe",
                     "--disable-background-networking", "--no-first-run", f"--window-size={width},{height}",
                     f"--user-data-dir={self.folder}/profile", "about:blank"]
        self.pid = os.posix_spawn(arguments[0], arguments, {**os.environ, "HOME": self.folder}, file_actions=actions,
                                  setpgroup=0)
        for fd in (to_read, to_write, null, *high):
            os.close(fd)
        self.buffer = b""
        self.count = 0
        self.session = None
        self.errors = []
        self.requests = []
        self.loaded = False
        target = self.call("Target.createTarget", url="about:blank", newWindow=True, width=width, height=height)["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(domain + ".enable")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            os.killpg(self.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        os.waitpid(self.pid, 0)
        os.close(self.out)
        os.close(self.inp)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _message(self):
        while b"\0" not in self.buffer:
            left = self.deadline - time.monotonic()
            if left <= 0 or not select.select([self.inp], [], [], left)[0]:
                raise TimeoutError("Chromium does not answer")
            more = os.read(self.inp, 1 << 20)
            if not more:
                raise RuntimeError("Chromium ended")
            self.buffer += more
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def _heard(self, message):
        method, params = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.errors.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        elif method == "Page.loadEventFired":
            self.loaded = True

    def call(self, method, **params):
        self.count += 1
        message = {"id": self.count, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._message()
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self._heard(answer)

    def open(self, address):
        self.loaded = False
        self.call("Page.navigate", url=address)
        while not self.loaded:
            self._heard(self._message())

    def evaluate(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"].get("exception", {}).get("description", expression))
        return result["result"].get("value")

    def until(self, expression, what, within_s=20):
        """Waits until the expression is true in the page."""
        end = time.monotonic() + within_s
        while not self.evaluate(f"!!({expression})"):
            if time.monotonic() > end:
                raise AssertionError(f"not within {within_s} s: {what}")
            time.sleep(0.05)

    def mouse(self, kind, x, y, pressed=False):
        self.call("Input.dispatchMouseEvent", type="mouse" + kind, x=x, y=y, button="left" if pressed or kind != "Moved" else "none",
                  buttons=1 if pressed else 0, clickCount=1 if kind != "Moved" else 0)

    def drag(self, x0, y0, x1, y1):
        self.mouse("Moved", x0, y0)
        self.mouse("Pressed", x0, y0, True)
        for i in range(1, 6):
            self.mouse("Moved", x0 + (x1 - x0) * i / 5, y0 + (y1 - y0) * i / 5, True)
        self.mouse("Released", x1, y1)

    def prefer(self, scheme=None, media=""):
        features = [{"name": "prefers-color-scheme", "value": scheme}] if scheme else []
        self.call("Emulation.setEmulatedMedia", media=media, features=features)

    def picture(self, path, whole=False):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self.call("Page.captureScreenshot", captureBeyondViewport=whole)["data"]))


def main():
    """browser.py PAGE.html PICTURE.png [dark|light|print] [SCROLL_PX]: what a page looks like, and what its scripts say."""
    scheme = sys.argv[3] if len(sys.argv) > 3 else "light"
    scroll = sys.argv[4] if len(sys.argv) > 4 else "0"
    with Browser(height=int(os.environ.get("HEIGHT", "1000")), width=int(os.environ.get("WIDTH", "1200"))) as browser:
        browser.prefer(None if scheme == "print" else scheme, "print" if scheme == "print" else "")
        browser.open("file://" + os.path.abspath(sys.argv[1]))
        browser.evaluate(f"document.querySelectorAll('details').forEach(d => d.open = {scroll} < 0); window.scrollTo(0, {scroll})")
        time.sleep(1)
        browser.picture(sys.argv[2])
        print(*browser.errors, sep="\n")
        print("height", browser.evaluate("document.body.scrollHeight"), "drawn", browser.evaluate("document.querySelectorAll('.drawn').length"))


if __name__ == "__main__":
    main()
