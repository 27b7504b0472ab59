"""What `cspm analyze manipulability` does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from cspm.commands.analyzed_machine import AnalyzedMachine
from cspm_control.analysis.cable_structure import cable_structure
from cspm_control.analysis.manipulability import (
    Ellipsoid,
    Manipulability,
    gyration_radius,
    manipulability,
)
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.console import make_console, say
from cspm_run.summary import write_json

PICTURE = "manipulability.png"
UNITS = {
    "force": ("N per N", "N·m per N"),
    "acceleration": ("m/s² per N", "rad/s² per N"),
}
LEAST_ENTRY = 0.05


def analyze_manipulability_command(
    machine: AnalyzedMachine, folder: Path | None, json: Path | None
) -> None:
    """Work out the manipulability at a pose, print, and write what was asked for.

    Raises:
        CspmError: the folder exists, or the cables span too few directions.
    """
    refuse_existing(folder)
    console = make_console()
    cables, parameters = (
        cable_structure(machine.testbed, machine.pose),
        nominal_parameters(machine.testbed),
    )
    found = manipulability(cables, parameters, machine.pose)
    _show(console, machine, found, gyration_radius(parameters))
    if folder is not None:
        from cspm.plots.manipulability_figure import draw_manipulability

        folder.mkdir(parents=True)
        draw_manipulability(folder / PICTURE, cables, parameters, machine.pose)
        say(console, f"written {folder / PICTURE}")
    if json is not None:
        write_json(json, _data(machine, found))


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


def _data(machine: AnalyzedMachine, found: Manipulability) -> dict[str, Any]:
    def ellipsoids(both: tuple[Ellipsoid, Ellipsoid]) -> list[dict[str, Any]]:
        return [
            {"dofs": each.dofs, "axes": each.axes.T.tolist(), "lengths": each.lengths.tolist()}
            for each in both
        ]

    return {
        "testbed": machine.testbed.name,
        "pose": list(machine.pose),
        "rank": found.rank,
        "measure": found.measure,
        "condition": found.condition,
        "scaled_condition": found.scaled_condition,
        "force_ellipsoids": ellipsoids(found.force),
        "acceleration_ellipsoids": ellipsoids(found.acceleration),
        "available_acceleration": {
            dof: [None if np.isnan(value) else value for value in ends]
            for dof, ends in found.available.items()
        },
    }
