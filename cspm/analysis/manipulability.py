"""How well cables move the bar at a pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cspm.analysis.machine import DEFAULT_SCENARIO, AnalyzedMachine, analyzed_machine
from cspm.scenario import AnyScenario
from cspm.testbed import AnyTestbed
from cspm_control.analysis.cable_structure import cable_structure
from cspm_control.analysis.manipulability import Ellipsoid, Manipulability, manipulability
from cspm_control.analysis.pose_grid import workspace_grids
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.new_folder import new_folder

PICTURE = "manipulability.png"


@dataclass(frozen=True, eq=False, repr=False)
class ManipulabilityAnalysis:
    """How well cables move the bar at a pose.

    Attributes:
        machine: what was analysed, and where.
        result: ellipsoids, conditions and accelerations.
    """

    machine: AnalyzedMachine
    result: Manipulability

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm analyze manipulability --json` writes."""
        return _data(self.machine, self.result)

    def write(self, folder: str | Path) -> Path:
        """Draw the ellipsoids; return the picture's path.

        Args:
            folder: a new one.

        Raises:
            InputError: the folder exists.
        """
        place = new_folder(folder)
        from cspm.plots.manipulability_figure import draw_manipulability

        machine = self.machine
        cables = cable_structure(machine.testbed, machine.pose)
        grids = workspace_grids(machine.testbed.name, cables.exits, cables.axes, machine.pose)
        draw_manipulability(
            place / PICTURE,
            cables,
            nominal_parameters(machine.testbed),
            machine.pose,
            grids["general"],
        )
        return place / PICTURE


def analyze_manipulability(
    scenario: AnyScenario = DEFAULT_SCENARIO,
    *,
    testbed: AnyTestbed | None = None,
    pose: Sequence[float] | None = None,
) -> ManipulabilityAnalysis:
    """Find how well cables move the bar at a pose: `cspm analyze manipulability`.

    Args:
        scenario: whose machine is analysed.
        testbed: a machine instead of the scenario's.
        pose: of the bar, x y z φ θ ψ in world_ned [m, rad]; None: where controllers are designed.

    Raises:
        InputError: no such scenario or test-bed, or a machine without bar.
        CspmError: the cables span too few directions.

    Examples:
        >>> import cspm
        >>> cspm.analyze_manipulability().result.rank
        5
    """
    return manipulability_of(analyzed_machine(scenario, testbed, pose))


def manipulability_of(machine: AnalyzedMachine) -> ManipulabilityAnalysis:
    """Return the analysis of a machine; see `analyze_manipulability`."""
    cables = cable_structure(machine.testbed, machine.pose)
    parameters = nominal_parameters(machine.testbed)
    return ManipulabilityAnalysis(machine, manipulability(cables, parameters, machine.pose))


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
