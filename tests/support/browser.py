# SPDX-License-Identifier: BSD-3-Clause
"""Chromium without a window, driven over its DevTools pipe with Python's standard library alone."""

import base64
import json
import os
import shutil
import struct
import subprocess
import tempfile
import zlib


def find():
    """Chromium's path, or None."""
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


class Browser:
    """One page. Commands and answers go through file descriptors 3 and 4, ended by a zero byte."""

    def __init__(self, program, graphics=("--disable-gpu",)):
        # The browser's other processes may write there for a moment after it has ended.
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        to_browser, self.write_end = os.pipe()
        self.read_end, from_browser = os.pipe()

        def connect():
            # Copies first, in case one of the pipes is 3 or 4 itself.
            first, second = os.dup(to_browser), os.dup(from_browser)
            os.dup2(first, 3)
            os.dup2(second, 4)

        self.process = subprocess.Popen(  # pylint: disable=subprocess-popen-preexec-fn
            [program, "--headless=new", "--remote-debugging-pipe", "--no-sandbox", *graphics,
             "--no-first-run", "--disable-extensions", "--hide-scrollbars", "--disable-dev-shm-usage",
             f"--user-data-dir={self.profile.name}", "--window-size=1000,900", "about:blank"],
            preexec_fn=connect, close_fds=False, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.count, self.buffer, self.session = 0, b"", None
        page = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]

    def close(self):
        os.close(self.write_end)
        self.process.kill()
        self.process.wait()
        os.close(self.read_end)
        self.profile.cleanup()

    def receive(self):
        while b"\0" not in self.buffer:
            some = os.read(self.read_end, 1 << 20)
            if not some:
                raise RuntimeError("the browser ended")
            self.buffer += some
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def call(self, method, **parameters):
        self.count += 1
        message = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.write_end, data):]
        while True:
            answer = self.receive()
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def evaluate(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"])
        return result["result"].get("value")

    def open(self, path):
        self.navigate(path.resolve().as_uri())
        self.evaluate("new Promise(done => document.readyState === 'complete' ? done() "
                      ": window.addEventListener('load', done))")

    def navigate(self, url):
        self.call("Page.enable")
        self.call("Page.navigate", url=url)

    def pixels(self, selector):
        """What an element looks like: width, height and rows of RGB."""
        self.evaluate(f"document.querySelector({selector!r}).scrollIntoView({{block: 'center'}})")
        # Pictures are read when they are scrolled to.
        self.evaluate(f"Promise.all([...document.querySelector({selector!r}).querySelectorAll('img')]"
                      ".filter(i => i.offsetParent).map(i => { i.loading = 'eager'; return i.decode(); }))")
        box = self.evaluate(f"(() => {{ const r = document.querySelector({selector!r}).getBoundingClientRect();"
                            "return [r.x + scrollX, r.y + scrollY, r.width, r.height]; })()")
        clip = dict(zip(("x", "y", "width", "height"), map(round, box)), scale=1)
        shot = self.call("Page.captureScreenshot", format="png", clip=clip, captureBeyondViewport=True)
        return decode_png(base64.b64decode(shot["data"]))


def decode_png(data):
    """Of 8-bit RGB or RGBA without interlacing, which is what Chromium writes."""
    at, packed, head = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", data[at + 8:at + 8 + size])
        elif kind == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    width, height, depth, color, _, _, interlaced = head
    assert depth == 8 and color in (2, 6) and not interlaced
    channels, raw = (3 if color == 2 else 4), zlib.decompress(packed)
    stride, rows, above = width * channels, [], bytes(width * channels)
    for y in range(height):
        start = y * (stride + 1)
        row = unfilter(raw[start], bytearray(raw[start + 1:start + 1 + stride]), above, channels)
        rows.append([tuple(row[x * channels:x * channels + 3]) for x in range(width)])
        above = row
    return width, height, rows


def unfilter(kind, row, above, channels):
    for i, value in enumerate(row):
        left = row[i - channels] if i >= channels else 0
        corner = above[i - channels] if i >= channels else 0
        if kind == 1:
            value += left
        elif kind == 2:
            value += above[i]
        elif kind == 3:
            value += (left + above[i]) // 2
        elif kind == 4:
            guess = left + above[i] - corner
            value += min((abs(guess - left), 0, left), (abs(guess - above[i]), 1, above[i]),
                         (abs(guess - corner), 2, corner))[2]
        row[i] = value & 255
    return row
