"""How often the import suspects a healthy recording.

`python -m bench.accuracy.healthy_imports [FOLDER]` simulates ten machines and seas with five seeds
each, exports what their sensors gave as a text table in the units of a laboratory, and imports it.
Nothing is wrong with any. Files that FOLDER has are not simulated again.
"""

from __future__ import annotations

import json
import sys
from itertools import product
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.table import Table

import cspm
from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.mapping import load_mapping
from cspm_ident.importing.preparation import prepare
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.recording.attached_testbed import attached_testbed
from cspm_msgs_py.testbed import TestbedFile
from cspm_msgs_py.topics import POSE, Topic
from cspm_msgs_py.yaml_file import dump_yaml

SCENARIOS = (
    *("calm", "worst_case", "worst_case_steep", "verification_mid", "one_winch"),
    *("emps", "stadium_camera", "planar_kntu", "cogiro", "rig_stiffness_sway"),
)
LOCKED = ("verification_mid",)
SEEDS = range(11, 16)
DURATION = 20.0
SENSORS = (
    *("/winches/state", "/cables/tension", "/bar/pose"),
    *("/bar/twist", "/winch_frame/pose", "/winch_frame/twist"),
)
# How a laboratory writes the parts of a JointState: unit, and its size in SI.
UNITS = {
    ("/winches/state", "position"): ("deg", 0.017453292519943295),
    ("/winches/state", "velocity"): ("rpm", 0.10471975511965977),
    ("/winches/state", "effort"): ("mN·m", 1e-3),
    ("/cables/tension", "effort"): ("kgf", 9.80665),
}


def main() -> None:
    """Simulate, export, import, and print what was suspected."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".results/healthy_imports")
    folder.mkdir(parents=True, exist_ok=True)
    console = Console()
    found = {
        f"{scenario}_{seed}": suspected(folder / f"{scenario}_{seed}", scenario, seed, console)
        for scenario, seed in product(SCENARIOS, SEEDS)
    }
    (folder / "suspicions.json").write_text(json.dumps(found, indent=1, ensure_ascii=False))
    console.print(table_of(found))
    files = sum(bool(each) for each in found.values())
    console.print(f"{files} of {len(found)} files with a suspicion")


def suspected(place: Path, scenario: str, seed: int, console: Console) -> list[str]:
    """Return what the import of one healthy file suspects, in place, kind and words."""
    recording = place / "recording"
    if not (place / "lab.yaml").exists():
        place.mkdir(exist_ok=True)
        duration = min(DURATION, cspm.load_scenario(scenario).description.duration)
        if not recording.exists():
            cspm.simulate(scenario, seed=seed, duration=duration).save(recording)
        export(recording, place)
    machine = machine_of(recording, scenario)
    with ColumnStore() as store:
        report = prepare(
            place / "lab.csv",
            load_mapping(place / "lab.yaml"),
            machine,
            store,
            lambda _: None,
            trial=False,
        ).report
    console.print(f"{place.name}: {len(report.suspicions)} suspicions")
    return [f"{each.where}: {each.kind}: {each.text}" for each in report.suspicions]


def machine_of(recording: Path, scenario: str) -> TestbedFile:
    """Return the machine as its owner describes it: brakes that hold its winches are said."""
    with Recording(recording) as opened:
        machine = cspm.Testbed(attached_testbed(opened.attachments, recording))
    if scenario in LOCKED:
        for name in machine.description.cable_names:
            machine = machine.with_parameter(f"cables.{name}.locked", True)
    return machine.file


def export(recording: Path, place: Path) -> None:
    """Write what the sensors gave as `lab.csv`, a line per instant, with its mapping."""
    columns: dict[str, pd.Series] = {}
    channels: dict[str, dict[str, dict[str, str]]] = {}
    with Recording(recording) as opened:
        for name in SENSORS:
            if name not in opened.topics or not opened.topics[name].count:
                continue
            topic, rows = opened.topic(name), opened.rows(name)
            channels[name] = {}
            for field, values in zip(topic.fields, rows.rows.T, strict=True):
                unit, size = unit_of(topic, field)
                column = f"{name.strip('/').replace('/', '_')} {field} [{unit}]"
                columns[column] = pd.Series(values / size, index=rows.stamp_ns)
                channels[name][field] = {"column": column, "unit": unit}
    table = pd.DataFrame(columns)
    table.insert(0, "time [s]", table.index * 1e-9)
    table.to_csv(place / "lab.csv", index=False)
    described = {"name": "lab", "clocks": {"pc": {"column": "time [s]"}}, "channels": channels}
    (place / "lab.yaml").write_text(dump_yaml(described), encoding="utf-8")


def unit_of(topic: Topic, field: str) -> tuple[str, float]:
    """Return the unit in which a field is written, and its size in SI."""
    if topic.parts:
        return UNITS[topic.name, field.partition("/")[0]]
    if topic.fields == POSE:
        return ("1", 1.0) if field.startswith("q") else ("mm", 1e-3)
    return ("rad/s", 1.0) if field.startswith("w") else ("m/s", 1.0)


def table_of(found: dict[str, list[str]]) -> Table:
    """Return the files in which something was suspected."""
    table = Table("file", "suspected")
    for name, texts in found.items():
        if texts:
            table.add_row(name, "\n".join(texts))
    return table


if __name__ == "__main__":
    main()
