"""What Chromium makes of a page on a screen of some width."""

import json
import re
import shutil
import subprocess

import pytest

# In a frame, since a window of Chromium is never narrower than 500 pixels.
_PROBE = """<body><iframe id=f width=%d height=900 src="%s"></iframe><script>
const errors = [];
const frame = document.getElementById('f');
frame.onload = () => {
  const page = frame.contentDocument.documentElement;
  frame.contentWindow.addEventListener('error', e => errors.push(e.message));
  setTimeout(async () => {
    const reported = await frame.contentWindow.eval(`(async () => {%s})()`);
    const found = {errors, reported, wide: page.scrollWidth, seen: page.clientWidth,
      plots: page.querySelectorAll('.scatterlayer').length};
    const out = document.createElement('pre');
    out.id = 'found'; out.textContent = JSON.stringify(found);
    document.body.append(out);
  }, 5000);
};
</script></body>"""


def find_browser():
    """Return where Chromium is; skip the test where there is none, best before it does anything."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no Chromium on this system")
    return browser


def look(page, width, script="return null"):
    """Return how wide the page is and is seen, its plots, its errors, and what it returned.

    The script is run in the page and may wait; what it returns is handed on. Skips the test where
    there is no Chromium.
    """
    browser = find_browser()
    probe = page.with_name("probe.html")
    probe.write_text(_PROBE % (width, page.name, script), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    options += ["--virtual-time-budget=20000", "--enable-logging=stderr", "--dump-dom"]
    shown = subprocess.run(
        [browser, *options, probe.as_uri()],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    assert "CONSOLE" not in shown.stderr
    return json.loads(re.search(r'<pre id="found">(.*?)</pre>', shown.stdout)[1])
