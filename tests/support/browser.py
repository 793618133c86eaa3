"""A headless Chromium that is asked over a pipe, as its developer tools ask it."""

import base64
import json
import os
import select
import shutil
import subprocess
import time

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


class Browser:
    """One page; what it complains of is in `complaints`."""

    def __init__(self, profile, width, height=1400):
        self._read, theirs_out = os.pipe()
        theirs_in, self._write = os.pipe()
        # The program takes descriptors 3 and 4, and a shell lays them there.
        command = [
            *("bash", "-c", 'exec "$0" "$@" 3<&"$IN" 4>&"$OUT"', CHROMIUM, "--headless"),
            *("--no-sandbox", "--disable-gpu", "--disable-extensions", "--remote-debugging-pipe"),
            *(f"--user-data-dir={profile}", "about:blank"),
        ]
        self._process = subprocess.Popen(
            command,
            env={**os.environ, "IN": str(theirs_in), "OUT": str(theirs_out)},
            pass_fds=(theirs_in, theirs_out),
            stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self._size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self._buffer, self._count, self._session = b"", 0, None
        self.complaints = []

    def __enter__(self):
        targets = self.call("Target.getTargets")["targetInfos"]
        (page,) = [one["targetId"] for one in targets if one["type"] == "page"]
        attach = {"targetId": page, "flatten": True}
        self._session = self.call("Target.attachToTarget", **attach)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", **self._size)
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        os.close(self._read)
        os.close(self._write)

    def call(self, method, **params):
        self._count += 1
        asked = {"id": self._count, "method": method, "params": params}
        if self._session is not None:
            asked["sessionId"] = self._session
        os.write(self._write, json.dumps(asked).encode() + b"\0")
        while (told := self._next()).get("id") != self._count:
            entry = told.get("params", {}).get("entry", {})
            if told.get("method") == "Runtime.exceptionThrown" or entry.get("level") == "error":
                self.complaints.append(told["params"])
        assert "error" not in told, told
        return told["result"]

    def _next(self, patience=60.0):
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._read], [], [], patience)
            assert ready, "the browser does not answer"
            more = os.read(self._read, 1 << 16)
            assert more, "the browser is gone"
            self._buffer += more
        raw, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(raw)

    def go(self, address):
        self.call("Page.navigate", url=address)

    def value(self, expression):
        """Return what an expression is in the page, None where it is nothing or a fault."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        return found["result"].get("value")

    def wait(self, expression, seconds=30.0):
        """Wait until an expression is true."""
        until = time.monotonic() + seconds
        while not self.value(expression):
            assert time.monotonic() < until, f"never: {expression}"
            time.sleep(0.05)

    def picture(self):
        return base64.b64decode(self.call("Page.captureScreenshot")["data"])
