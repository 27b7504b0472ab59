"""The viewer's page: one HTML file with everything inside."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm.view.frames import Frames
from cspm.view.marks import Mark
from cspm_msgs_py.testbed import Cable, Testbed

SCRIPTS = ("data.js", "palette.js", "camera.js", "scene.js", "plots.js", "player.js")
LIVE_SCRIPT = "live.js"
# What the page may do when it is opened: draw. It can load nothing and reach nobody, but for the
# server that shows a run as it happens.
_OWN_SERVER = "; connect-src 'self'"
_CLOSED = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"


def viewer_page(
    machine: Testbed,
    runs: Sequence[Frames],
    marks: Sequence[Mark] = (),
    *,
    live: bool = False,
) -> str:
    """Return the page as HTML.

    Args:
        machine: whose geometry to draw.
        runs: one, or two to lay over one another.
        marks: parts to point at.
        live: whether it asks its server for what came since.
    """
    title = " and ".join(run.name for run in runs)
    heads, numbers = packed(runs)
    data = {
        "title": title,
        "machine": machine_shape(machine),
        "runs": heads,
        "marks": [mark.data() for mark in marks],
    }
    folder = files("cspm.view") / "page"
    body = (folder / "body.html").read_text(encoding="utf-8")
    names = (*SCRIPTS, LIVE_SCRIPT) if live else SCRIPTS
    scripts = "\n".join((folder / name).read_text(encoding="utf-8") for name in names)
    policy = f"{_CLOSED}{_OWN_SERVER if live else ''}"
    return "\n".join(
        (
            "<!doctype html><html lang=en><head><meta charset=utf-8>",
            "<meta name=viewport content='width=device-width, initial-scale=1'>",
            f'<meta http-equiv=Content-Security-Policy content="{policy}">',
            f"<title>{escape(title)}: cspm view</title>",
            f"<style>{(folder / 'viewer.css').read_text(encoding='utf-8')}</style></head>",
            body,
            f"<script type=application/json id=view>{_inside_html(data)}</script>",
            f"<script type=text/plain id=numbers>{numbers}</script>",
            f"<script>{scripts}</script></html>",
        )
    )


def packed(runs: Sequence[Frames]) -> tuple[list[dict[str, Any]], str]:
    """Return the heads of runs, and all their numbers as little-endian floats in base 64."""
    blocks: list[bytes] = []
    heads = [_run(run, blocks) for run in runs]
    return heads, b64encode(b"".join(blocks)).decode()


def machine_shape(machine: Testbed) -> dict[str, Any]:
    """Return the geometry of a machine as plain data [m]: boxes, and cables in file order."""
    bar, frame = machine.bar, machine.winch_frame
    return {
        "name": machine.name,
        "bar": None if bar is None else bar.dimensions,
        "frame": None if frame is None else frame.dimensions,
        "cables": [_cable(cable) for cable in machine.cables],
        "slack": _slack_below(machine),
    }


def _cable(cable: Cable) -> dict[str, Any]:
    return {
        "name": cable.name,
        "exit": cable.exit,
        "attachment": cable.attachment,
        "gear_ratio": cable.gear_ratio,
        "limits": cable.tension_limits,
    }


def _slack_below(machine: Testbed) -> float:
    """Return the tension up to which a cable counts as slack [N]: three times the cells' noise."""
    cells = machine.sensors.get("/cables/tension")
    return 0.0 if cells is None else 3.0 * max(cells.noise)


def _run(run: Frames, blocks: list[bytes]) -> dict[str, Any]:
    """Return a run's head; its numbers are added to the blocks, in the order of the head."""
    for pose in run.poses.values():
        blocks.append(_bytes(pose))
    for trace in run.traces:
        blocks += [_bytes(trace.low), _bytes(trace.high)]
    traces = [{"title": t.title, "unit": t.unit, "names": t.names} for t in run.traces]
    return {
        "name": run.name,
        "period": run.period,
        "count": run.count,
        "poses": list(run.poses),
        "traces": traces,
    }


def _bytes(values: NDArray[np.float64]) -> bytes:
    return values.astype("<f4").tobytes()


def _inside_html(data: object) -> str:
    """Return JSON that no HTML parser takes for markup."""
    return json.dumps(data, ensure_ascii=False).replace("<", "\\u003c")
