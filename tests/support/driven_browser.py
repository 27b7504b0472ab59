"""Chromium driven as a reader does: pages opened, keys pressed, scripts run, errors listed."""

import json
import re
import shutil
import subprocess
import urllib.request
from base64 import b64decode
from contextlib import contextmanager

import pytest

_FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
_KEYS = {"ArrowLeft": "\ue012", "ArrowRight": "\ue014", "Home": "\ue011", "End": "\ue010"}
# A busy machine starts a browser in a minute.
_PATIENCE_S = 180


def find_driver():
    """Return the paths of Chromium and its driver; skip the test where one is missing."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    driver = shutil.which("chromedriver")
    if browser is None or driver is None:
        pytest.skip("no Chromium with chromedriver on this system")
    return browser, driver


class Browser:
    """One window of a headless Chromium, by the W3C's WebDriver protocol."""

    def __init__(self, address, session):
        self._place = f"{address}/session/{session}"

    def open(self, url, width=1200, height=900):
        """Open a page on a screen of some size, as seen from inside the window."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        more = {"cmd": "Emulation.setDeviceMetricsOverride", "params": size}
        self._ask("/goog/cdp/execute", more)
        self._ask("/url", {"url": url})

    def run(self, script):
        """Run the body of an asynchronous function in the page, and return what it returns."""
        text = f"const d = arguments[0]; (async () => {{{script}}})().then(d, e => d('' + e))"
        return self._ask("/execute/async", {"script": text, "args": []})

    def press(self, *keys):
        """Press keys one after another, in whatever has the focus."""
        steps = [
            {"type": kind, "value": _KEYS.get(key, key)}
            for key in keys
            for kind in ("keyDown", "keyUp")
        ]
        self._ask("/actions", {"actions": [{"type": "key", "id": "keys", "actions": steps}]})

    def drawn(self):
        """Wait until all that was asked for is drawn."""
        self.run("await new Promise(d => requestAnimationFrame(() => requestAnimationFrame(d)))")

    def errors(self):
        """Return what the console says since the last call."""
        return [each["message"] for each in self._ask("/se/log", {"type": "browser"})]

    def picture(self, path):
        """Write a picture of what is seen."""
        with urllib.request.urlopen(f"{self._place}/screenshot", timeout=_PATIENCE_S) as answer:
            path.write_bytes(b64decode(json.load(answer)["value"]))

    def pages(self):
        """Return how many sheets of A4 the page takes when it is printed."""
        size = {"width": 21.0, "height": 29.7}
        printed = b64decode(self._ask("/print", {"page": size}))
        return len(re.findall(rb"/Type\s*/Page\b", printed))

    def _ask(self, path, data):
        return _post(self._place + path, data)["value"]


def _post(url, data, method="POST"):
    body = json.dumps(data).encode()
    request = urllib.request.Request(url, body, {"Content-Type": "application/json"}, method=method)
    with urllib.request.urlopen(request, timeout=_PATIENCE_S) as answer:
        return json.load(answer)


@contextmanager
def driven_browser(folder):
    """Yield a browser that keeps its profile in a folder; skip where there is none."""
    browser, driver = find_driver()
    process = subprocess.Popen([driver, "--port=0"], stdout=subprocess.PIPE, text=True)
    try:
        line = next(each for each in process.stdout if "successfully on port" in each)
        address = f"http://127.0.0.1:{line.rstrip().rstrip('.').rsplit(' ', 1)[1]}"
        options = {"binary": browser, "args": [*_FLAGS, f"--user-data-dir={folder}"]}
        patience = {"script": 1000 * _PATIENCE_S, "pageLoad": 1000 * _PATIENCE_S}
        logs = {"browser": "ALL"}
        wanted = {"goog:chromeOptions": options, "goog:loggingPrefs": logs, "timeouts": patience}
        begun = _post(f"{address}/session", {"capabilities": {"alwaysMatch": wanted}})
        session = begun["value"]["sessionId"]
        try:
            yield Browser(address, session)
        finally:
            _post(f"{address}/session/{session}", {}, "DELETE")
    finally:
        process.terminate()
        process.wait(timeout=_PATIENCE_S)
        process.stdout.close()
