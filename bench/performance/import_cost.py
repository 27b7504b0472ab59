"""What an import of a long table and of a large bag takes.

`python -m bench.performance.import_cost [GIGABYTES …]` imports a table of 600 s at 1 kHz with 39
channels three times, and for each size a bag of joint states, and prints times and peak memory.
"""

from __future__ import annotations

import sys
import time
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from bench.performance.child import start_cspm, watched
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.topics import POSE
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_run.library import find_testbed

SECONDS, RATE, REPEATS = 600, 1000, 3
_TYPES = get_typestore(Stores.ROS2_JAZZY)
_KIND = "sensor_msgs/msg/JointState"
_UNITS = {"position": "rad", "velocity": "rad/s", "effort": "N·m"}


def main() -> None:
    """Measure and print."""
    sizes = [float(word) for word in sys.argv[1:]] or [0.25, 1.0]
    shown = Table("source", "size GB", "time s", "resident MB", "own MB")
    with ScratchFolder("bench") as place:
        write_table(place)
        found = [imported(place, "lab.csv", f"table_{k}") for k in range(REPEATS)]
        size = (place / "lab.csv").stat().st_size / 1e9
        shown.add_row("table", *cells(size, sorted(found)[REPEATS // 2]))
    for size in sizes:
        with ScratchFolder("bench") as place:
            write_bag(place, size)
            shown.add_row("bag", *cells(size, imported(place, "bag", "out")))
    Console().print(shown)


def cells(gigabytes: float, cost: Cost) -> tuple[str, ...]:
    """Return a row of the table, without its name."""
    return f"{gigabytes:.2f}", f"{cost.seconds:.1f}", f"{cost.resident:.0f}", f"{cost.own:.0f}"


@cache
def cables() -> tuple[str, ...]:
    """Return the names of the thesis's cables."""
    return load_testbed(find_testbed("thesis")).testbed.cable_names


class Cost(NamedTuple):
    """What an import took: time [s], and the largest memory [MB].

    `resident` counts pages of files that were read, which the system takes back; `own` does not.
    """

    seconds: float
    resident: float
    own: float


def imported(place: Path, source: str, name: str) -> Cost:
    """Import a file as a process of its own, and return what it took."""
    paths = [str(place / source), "--mapping", str(place / "lab.yaml"), "--testbed", "thesis"]
    began = time.perf_counter()
    child = start_cspm(["import", *paths, "--out", str(place / name)], {})
    looks = list(watched(child, lambda process: process.memory_info()))
    seconds = time.perf_counter() - began
    resident = max(look.rss for look in looks) / 1e6
    return Cost(seconds, resident, max(look.rss - look.shared for look in looks) / 1e6)


def joint_channels(column: str, units: dict[str, str]) -> dict[str, dict[str, str]]:
    """Return the channels of a JointState, their columns named by a pattern of part and name."""
    return {
        f"{part}/{name}": {"column": column.format(part=part, name=name), "unit": unit}
        for part, unit in units.items()
        for name in cables()
    }


def write_table(place: Path) -> None:
    """Write the table and its mapping: all winches, all load cells, the bar's pose."""
    rng = np.random.default_rng(1)
    t = np.arange(SECONDS * RATE) / RATE
    channels = {
        "/winches/state": joint_channels("drive {part} {name}", _UNITS),
        "/cables/tension": joint_channels("cell {name}", {"effort": "N"}),
    }
    columns = {"t": t}
    for each in (*channels["/winches/state"].values(), *channels["/cables/tension"].values()):
        columns[each["column"]] = _signal(rng, t)
    pose = {name: 0.01 * _signal(rng, t) for name in POSE[:6]}
    pose["qw"] = np.sqrt(1.0 - sum(pose[name] ** 2 for name in POSE[3:6]))
    columns |= pose
    channels["/bar/pose"] = {
        name: {"column": name, "unit": "1" if name.startswith("q") else "m"} for name in POSE
    }
    pd.DataFrame(columns).round(6).to_csv(place / "lab.csv", index=False)
    described = {"name": "lab", "clocks": {"pc": {"column": "t"}}, "channels": channels}
    (place / "lab.yaml").write_text(dump_yaml(described), encoding="utf-8")


def _signal(rng: np.random.Generator, t: np.ndarray) -> np.ndarray:
    rate, phase = rng.uniform(1.0, 5.0), rng.uniform(0.0, 6.0)
    return 1.0 + 0.3 * np.sin(rate * t + phase) + rng.normal(0.0, 1e-3, len(t))


def write_bag(place: Path, gigabytes: float) -> None:
    """Write a bag of joint states of all winches, and its mapping."""
    names = list(cables())
    header, state = _TYPES.types["std_msgs/msg/Header"], _TYPES.types[_KIND]
    stamp = _TYPES.types["builtin_interfaces/msg/Time"]
    written, k = 0.0, 0
    with Writer(place / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        sender = writer.add_connection("/drives", _KIND, typestore=_TYPES)
        while written < gigabytes * 1e9:
            now = k * 1_000_000
            values = [np.sin(np.arange(8.0) + k * f) for f in (1e-3, 2e-3, 3e-3)]
            head = header(stamp(*divmod(now, 10**9)), "")
            content = _TYPES.serialize_cdr(state(head, names, *values), _KIND)
            writer.write(sender, now, content)
            written, k = written + len(content), k + 1
    channels = {"/winches/state": joint_channels("/drives:{part}[{name}]", _UNITS)}
    described = {"name": "lab", "channels": channels}
    (place / "lab.yaml").write_text(dump_yaml(described), encoding="utf-8")


if __name__ == "__main__":
    main()
