"""The command `cspm analyze manipulability`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from cspm.analysis.machine import AnalyzedMachine
from cspm.analysis.manipulability import manipulability_of
from cspm.commands.progress_shown import shown
from cspm_control.analysis.manipulability import Ellipsoid, Manipulability
from cspm_model.parameters import nominal_parameters
from cspm_model.spanned_axes import gyration_radius
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

UNITS = {
    "force": ("N per N", "N·m per N"),
    "acceleration": ("m/s² per N", "rad/s² per N"),
}
LEAST_ENTRY = 0.05


def analyze_manipulability_command(
    machine: AnalyzedMachine, folder: Path | None, json: Path | None
) -> None:
    """Compute the manipulability at a pose, print the results, and write the requested files.

    Raises:
        CspmError: the folder exists, or the cables span too few directions.
    """
    refuse_existing(folder)
    console = make_console()
    with shown(console, "manipulability"):
        found = manipulability_of(machine)
    radius = gyration_radius(nominal_parameters(machine.testbed))
    _show(console, machine, found.result, radius)
    if folder is not None:
        say(console, f"written {found.write(folder)}")
    if json is not None:
        write_json(json, found.data())


def _show(console: Console, machine: AnalyzedMachine, found: Manipulability, radius: float) -> None:
    pose = ", ".join(f"{value:g}" for value in machine.pose)
    say(console, f"{machine.testbed.name} at [{pose}] (m, rad); rank of Jᵀ {found.rank}")
    say(
        console,
        f"measure of manipulability {found.measure:.4g}, moments over the radius of gyration"
        f" {radius:.4g} m; κ {found.condition:.4g}, {found.scaled_condition:.4g} with moments so"
        " scaled",
    )
    table = Table(title="ellipsoids of |t| = 1 N: half axes", box=box.SIMPLE_HEAD)
    for heading in ("of", "half axis", "along"):
        table.add_column(heading, justify="right" if heading == "half axis" else "left")
    for kind, ellipsoids in (("force", found.force), ("acceleration", found.acceleration)):
        for ellipsoid, unit in zip(ellipsoids, UNITS[kind], strict=True):
            for length, axis in zip(ellipsoid.lengths, ellipsoid.axes.T, strict=True):
                table.add_row(kind, f"{length:.4g} {unit}", _along(ellipsoid, axis))
    console.print(table)
    console.print(_available_table(found))


def _along(ellipsoid: Ellipsoid, axis: Any) -> str:  # noqa: ANN401 - an array
    parts = zip(axis, ellipsoid.dofs, strict=True)
    return ", ".join(f"{abs(value):.2f} {dof}" for value, dof in parts if abs(value) > LEAST_ENTRY)


def _available_table(found: Manipulability) -> Table:
    table = Table(title="largest acceleration from rest", box=box.SIMPLE_HEAD)
    table.add_column("")
    for heading in ("against the axis", "along the axis"):
        table.add_column(heading, justify="right")
    for dof, ends in found.available.items():
        unit = "rad/s²" if dof in ("roll", "pitch", "yaw") else "m/s²"
        table.add_row(
            dof, *("none" if np.isnan(value) else f"{value:.4g} {unit}" for value in ends)
        )
    return table
