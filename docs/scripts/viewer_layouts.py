"""Layouts of RViz, Foxglove and PlotJuggler for a machine, made of its description.

Run `python docs/scripts/viewer_layouts.py` for those in `launch/views`, of the thesis's machine;
`python docs/scripts/viewer_layouts.py TESTBED FOLDER` for another's. Foxglove's own kit writes its
layout: `pip install foxglove-sdk`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

from foxglove import layouts as fox

from cspm_model.scene.urdf import ROOT
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.topics import DIAGNOSTICS, MARKERS, ROBOT_DESCRIPTION
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_run.library import find_testbed

FOLDER = Path(__file__).resolve().parents[2] / "launch" / "views"
TENSION, TORQUE = "/cables/tension", "/winches/torque_command"
POSE, REFERENCE = "/bar/pose", "/bar/reference"
_AXES = ("x", "y", "z")
_COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f")


def foxglove(cables: Sequence[str], size: float) -> str:
    """Return Foxglove's layout: the machine, its diagnostics, tensions, torques and the bar."""
    urdf = fox.BaseRendererUrdfLayerSettings(
        layer_id="foxglove.Urdf",
        instance_id="machine",
        label="Machine",
        visible=True,
        source_type="topic",
        topic=ROBOT_DESCRIPTION.name,
        control_mode="transforms",
    )
    scene = fox.ThreeDeePanel(
        title="Machine",
        config=fox.ThreeDeeConfig(
            follow_tf=ROOT,
            camera_state=fox.ThreeDeeCameraState(
                distance=4.0 * size, phi=65.0, theta_offset=40.0, target_offset=(0.0, 0.0, -size)
            ),
            layers={"machine": urdf},
            topics={MARKERS.name: fox.BaseRendererRosMarkerTopicSettings(visible=True)},
        ),
    )
    diagnostics = fox.DiagnosticsSummaryPanel(
        config=fox.DiagnosticsSummaryConfig(topic_to_render=DIAGNOSTICS.name, sort_by_level=True)
    )
    numbers = [
        _plot("Cable tensions [N]", [(f"{TENSION}.effort[{i}]", c) for i, c in enumerate(cables)]),
        _plot("Torques [N·m]", [(f"{TORQUE}.effort[{i}]", c) for i, c in enumerate(cables)]),
        _plot("Bar and its reference [m]", [*_measured(), *_wanted()]),
    ]
    left, right = [(3.0, scene), (1.0, diagnostics)], [(1.0, each) for each in numbers]
    sides = [(1.0, _split("column", left)), (1.0, _split("column", right))]
    return str(fox.Layout(content=_split("row", sides)).to_json()) + "\n"


def _measured() -> list[tuple[str, str]]:
    return [(f"{POSE}.pose.position.{axis}", axis) for axis in _AXES]


def _wanted() -> list[tuple[str, str]]:
    place = f"{REFERENCE}.points[0].transforms[0].translation"
    return [(f"{place}.{axis}", f"{axis} wanted") for axis in _AXES]


def _plot(title: str, series: Sequence[tuple[str, str]]) -> fox.PlotPanel:
    paths = [
        fox.PlotSeries(value=path, label=label, enabled=True, timestamp_method="headerStamp")
        for path, label in series
    ]
    return fox.PlotPanel(title=title, config=fox.PlotConfig(paths=paths, show_legend=True))


def _split(direction: str, items: Sequence[tuple[float, object]]) -> fox.SplitContainer:
    found = [fox.SplitItem(proportion=share, content=content) for share, content in items]
    return fox.SplitContainer(direction=direction, items=found)


def plotjuggler(cables: Sequence[str]) -> str:
    """Return PlotJuggler's layout: tensions, torques and the bar's position, one below another."""
    root = ET.Element("root")
    tabs = ET.SubElement(root, "tabbed_widget", parent="main_window", name="Main Window")
    tab = ET.SubElement(tabs, "Tab", containers="1", tab_name="cspm")
    container = ET.SubElement(tab, "Container")
    plots = {
        "Cable tensions [N]": [f"{TENSION}/{cable}/effort" for cable in cables],
        "Torques [N·m]": [f"{TORQUE}/{cable}/effort" for cable in cables],
        "Bar [m]": [f"{POSE}/pose/position/{axis}" for axis in _AXES],
    }
    sizes = ";".join(["0.333333"] * len(plots))
    splitter = ET.SubElement(container, "DockSplitter", orientation="-", sizes=sizes)
    splitter.set("count", str(len(plots)))
    for title, curves in plots.items():
        area = ET.SubElement(splitter, "DockArea", name=title)
        plot = ET.SubElement(area, "plot", mode="TimeSeries", style="Lines")
        for i, name in enumerate(curves):
            ET.SubElement(plot, "curve", name=name, color=_COLOURS[i % len(_COLOURS)])
    ET.SubElement(tabs, "currentTabIndex", index="0")
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{text}\n"


def rviz(size: float) -> str:
    """Return RViz's configuration: grid, machine, frames and markers below `world`."""
    latched = {"Durability Policy": "Transient Local"}
    displays = [
        {"Class": "rviz_default_plugins/Grid", "Name": "Grid", "Cell Size": size},
        {
            "Class": "rviz_default_plugins/RobotModel",
            "Name": "Machine",
            "Description Source": "Topic",
            "Description Topic": {"Value": ROBOT_DESCRIPTION.name, **latched},
        },
        {"Class": "rviz_default_plugins/TF", "Name": "Frames", "Marker Scale": 0.3 * size},
        {
            "Class": "rviz_default_plugins/MarkerArray",
            "Name": "Cables",
            "Topic": {"Value": MARKERS.name, "Reliability Policy": "Reliable"},
        },
    ]
    view = {
        "Class": "rviz_default_plugins/Orbit",
        "Distance": 4.0 * size,
        "Focal Point": {"X": 0.0, "Y": 0.0, "Z": -size},
        "Pitch": 0.3,
        "Yaw": 0.8,
        "Target Frame": "<Fixed Frame>",
    }
    manager = {
        "Class": "",
        "Displays": [{**display, "Enabled": True, "Value": True} for display in displays],
        "Global Options": {"Fixed Frame": ROOT, "Frame Rate": 30},
        "Tools": [{"Class": "rviz_default_plugins/MoveCamera"}],
        "Views": {"Current": view},
    }
    panels = [{"Class": "rviz_common/Displays", "Name": "Displays"}]
    return dump_yaml({"Panels": panels, "Visualization Manager": manager})


def main(testbed: str = "thesis", folder: Path = FOLDER) -> None:
    """Write the three layouts of a machine."""
    machine = load_testbed(find_testbed(testbed)).testbed
    exits = [cable.exit for cable in machine.cables if cable.exit is not None]
    spans = [max(axis) - min(axis) for axis in zip(*exits, strict=True)]
    size = max(spans, default=0.0) or 1.0
    names = [cable.name for cable in machine.cables]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "foxglove.json").write_text(foxglove(names, size))
    (folder / "plotjuggler.xml").write_text(plotjuggler(names))
    (folder / "cspm.rviz").write_text(rviz(size))


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(Path, sys.argv[2:3]))
