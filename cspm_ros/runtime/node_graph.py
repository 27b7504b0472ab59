"""A picture of the nodes and topics, drawn from the tables that the nodes themselves use."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from cspm_msgs_py.graph import RECORDER, Edges, graph_of
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.schedule import (
    FORCE_CONTROLLER,
    MOTION_CONTROLLER,
    PLANT,
    TENSION_DISTRIBUTION,
    WAVE_TRAJECTORY,
    schedule_of,
)
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.topics import DIAGNOSTICS
from cspm_run.library import find_scenario

# The cascade runs from left to right above the plant, which is as wide as all of it.
COLUMNS = {
    WAVE_TRAJECTORY: 0.0,
    MOTION_CONTROLLER: 1.0,
    TENSION_DISTRIBUTION: 2.0,
    FORCE_CONTROLLER: 3.0,
}
_HALF_WIDTH, _HALF_HEIGHT, _DEPTH = 0.32, 0.1, -1.0
_NODE_COLOUR, _TOPIC_COLOUR = "#dce6f2", "#30507a"


def thesis_graph() -> dict[str, Edges]:
    """Return senders and readers of every topic of the thesis's machine in closed loop."""
    path = find_scenario("calm")
    scenario = load_scenario(path)
    schedule = schedule_of(scenario, load_testbed(path.parent / scenario.testbed).testbed)
    return graph_of(schedule, (PLANT, *schedule.nodes, RECORDER))


def arrows(edges: Mapping[str, Edges]) -> dict[tuple[str, str], list[str]]:
    """Return the topics from node to node, without those that only the recorder reads."""
    found: dict[tuple[str, str], list[str]] = {}
    for topic, edge in edges.items():
        for sender in edge.senders:
            for reader in edge.readers:
                if reader != RECORDER:
                    found.setdefault((sender, reader), []).append(topic)
    return found


def draw(path: Path) -> None:
    """Write the picture; the name's ending says as what."""
    edges = thesis_graph()
    figure = Figure(figsize=(11.0, 4.4))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(-0.45, 4.0)
    axes.set_ylim(-1.5, 0.25)
    for name, x in COLUMNS.items():
        _box(axes, name, x - _HALF_WIDTH, x + _HALF_WIDTH, 0.0)
    _box(axes, PLANT, -_HALF_WIDTH, 3.0 + _HALF_WIDTH, _DEPTH)
    for (sender, reader), topics in arrows(edges).items():
        _arrow(axes, sender, reader, topics)
    truth = sum(topic.startswith("/truth/") for topic in edges)
    everything = (
        f"{RECORDER} reads all of these, {DIAGNOSTICS.name} of every node, the winch frame's"
        f" reference and the plant's {truth} topics /truth/…"
    )
    axes.text(1.5, -1.32, everything, ha="center", fontsize=9, style="italic")
    figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)


def _box(axes: Axes, name: str, left: float, right: float, y: float) -> None:
    corner, size = (left, y - _HALF_HEIGHT), (right - left, 2.0 * _HALF_HEIGHT)
    style: dict[str, Any] = {"facecolor": _NODE_COLOUR, "edgecolor": "black"}
    axes.add_patch(FancyBboxPatch(corner, *size, boxstyle="round,pad=0.02", **style))
    axes.text(0.5 * (left + right), y, name, ha="center", va="center", fontsize=11)


def _arrow(axes: Axes, sender: str, reader: str, topics: list[str]) -> None:
    """Draw a level arrow between controllers, an upright one to and from the plant."""
    edge = _HALF_HEIGHT + 0.03
    if PLANT not in (sender, reader):
        start = (COLUMNS[sender] + _HALF_WIDTH + 0.03, 0.0)
        end = (COLUMNS[reader] - _HALF_WIDTH - 0.03, 0.0)
        place, align = (0.5 * (start[0] + end[0]), 0.16), "center"
    elif sender == PLANT:
        x = COLUMNS[reader]
        start, end = (x, _DEPTH + edge), (x, -edge)
        place, align = (x - 0.03, 0.5 * _DEPTH), "right"
    else:
        x = COLUMNS[sender] + 0.12
        start, end = (x, -edge), (x, _DEPTH + edge)
        place, align = (x + 0.03, 0.5 * _DEPTH), "left"
    axes.annotate("", xy=end, xytext=start, arrowprops={"arrowstyle": "-|>", "color": "black"})
    style: dict[str, Any] = {"fontsize": 9, "color": _TOPIC_COLOUR, "family": "monospace"}
    axes.text(*place, "\n".join(topics), ha=align, va="center", **style)


if __name__ == "__main__":
    import matplotlib as mpl

    mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "cspm"})
    draw(Path(sys.argv[1]))
