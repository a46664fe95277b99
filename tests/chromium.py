"""Headless Chromium, told what to do through its debugging pipe: pages are used with real keys, and looked at."""

import base64
import contextlib
import itertools
import json
import os
import shutil
import signal
import time

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
OPTIONS = "--headless --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run --hide-scrollbars".split()
OPTIONS += "--disable-background-networking --disable-component-update --disable-sync --disable-extensions".split()
# Of tests that need it.
WANTED = [
    pytest.mark.slow,
    pytest.mark.skipif(
        CHROMIUM is None and os.environ.get("ICHA_REQUIRE_CHROMIUM") != "1",
        reason=f"no Chromium on the path, under none of {', '.join(NAMES)}",
    ),
]
# Key, its code, the number that Windows gives it.
KEYS = {"End": 35, "ArrowLeft": 37}
# How long a page may take, seconds.
PATIENCE = 300


class Page:
    """An open page: what it asked for, what it said to its console, and keys, scripts and pictures."""

    def __init__(self, commands, answers):
        """Talk through the two ends of a pipe; `open` then opens a page."""
        self._commands, self._answers, self._numbers = commands, answers, itertools.count(1)
        self._rest, self._session = b"", None
        self.console: list[str] = []
        self.addresses: list[str] = []
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self._call(f"{domain}.enable")

    def open(self, file):
        """Load a file and wait until it has."""
        self._call("Page.navigate", url=file.as_uri())
        end = time.monotonic() + PATIENCE
        while self.value("document.readyState") != "complete" or self.value("location.href") == "about:blank":
            assert time.monotonic() < end, "the page does not load"
        self.settle()

    def settle(self):
        """Wait until the page has drawn what it was told to."""
        self.value("new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(go, 50))))")

    def show(self, width, height=900, scheme="light", medium=""):
        """Set the size of the window, the scheme of colours that the reader prefers, and the medium, such as print."""
        self._call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self._call("Emulation.setEmulatedMedia", media=medium, features=features)
        self.settle()

    def value(self, expression):
        """What an expression of JavaScript, or the promise that it is, comes to."""
        found = self._call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def press(self, key):
        """Press a key on what has the focus."""
        for kind in ("keyDown", "keyUp"):
            self._call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=KEYS[key])
        self.settle()

    def picture(self):
        """The whole page as a PNG."""
        return base64.b64decode(self._call("Page.captureScreenshot", captureBeyondViewport=True)["data"])

    def _call(self, method, **parameters):
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        message |= {"sessionId": self._session} if self._session else {}
        os.write(self._commands, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == number:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]
            self._note(answer)

    def _note(self, event):
        found = event.get("params", {})
        match event.get("method"):
            case "Runtime.consoleAPICalled":
                self.console.append(" ".join(str(each.get("value", each)) for each in found["args"]))
            case "Runtime.exceptionThrown":
                self.console.append(found["exceptionDetails"]["exception"].get("description", "exception"))
            case "Log.entryAdded":
                self.console.append(found["entry"]["text"])
            case "Network.requestWillBeSent":
                self.addresses.append(found["request"]["url"])

    def _read(self):
        while b"\0" not in self._rest:
            part = os.read(self._answers, 2**20)
            assert part, "Chromium has ended"
            self._rest += part
        message, _, self._rest = self._rest.partition(b"\0")
        return json.loads(message)


@contextlib.contextmanager
def chromium(profile):
    """A page of a Chromium of its own, with its files in the folder `profile`."""
    to_read, commands = os.pipe()
    answers, to_write = os.pipe()
    command = [CHROMIUM, *OPTIONS, "--remote-debugging-pipe", f"--user-data-dir={profile}"]
    # Chromium reads from its file 3 and writes to 4.
    files = [(os.POSIX_SPAWN_DUP2, to_read, 3), (os.POSIX_SPAWN_DUP2, to_write, 4)]
    files += [(os.POSIX_SPAWN_OPEN, 2, os.devnull, os.O_WRONLY, 0)]
    process = os.posix_spawn(CHROMIUM, command, os.environ, file_actions=files)
    os.close(to_read), os.close(to_write)
    try:
        yield Page(commands, answers)
    finally:
        os.kill(process, signal.SIGTERM)
        os.waitpid(process, 0)
        os.close(commands), os.close(answers)
