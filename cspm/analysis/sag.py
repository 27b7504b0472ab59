"""How cables with weight hold the bar at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cspm.analysis.machine import DEFAULT_SCENARIO, AnalyzedMachine, analyzed_machine
from cspm.scenario import AnyScenario
from cspm.testbed import AnyTestbed
from cspm_control.analysis.sag import SaggingCable, sagging_cables
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

SAG = "cable_sag"


@dataclass(frozen=True)
class SagAnalysis:
    """How cables with weight hold the bar at rest.

    Attributes:
        machine: what was analysed, and where.
        densities: of the cables [kg/m].
        cables: what each carries and how it hangs.
    """

    machine: AnalyzedMachine
    densities: tuple[float, ...]
    cables: tuple[SaggingCable, ...]

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm analyze sag --json` writes."""
        return {
            "testbed": self.machine.testbed.name,
            "pose": list(self.machine.pose),
            "cables": [
                {"linear_density": density, **cable._asdict()}
                for density, cable in zip(self.densities, self.cables, strict=True)
            ],
        }


def analyze_sag(
    scenario: AnyScenario = DEFAULT_SCENARIO,
    *,
    testbed: AnyTestbed | None = None,
    pose: Sequence[float] | None = None,
    linear_density: float | None = None,
) -> SagAnalysis:
    """Find tensions, sag and loss of stiffness of cables with weight: `cspm analyze sag`.

    Args:
        scenario: whose machine is analysed.
        testbed: a machine instead of the scenario's.
        pose: of the bar, x y z φ θ ψ in world_ned [m, rad]; None: where controllers are designed.
        linear_density: of all cables [kg/m]; None: that of the test-bed's effect `cable_sag`.

    Raises:
        InputError: no such scenario or test-bed, no density, or a cable over a pulley.
        ConvergenceError: no tensions within the limits hold bar and cables.

    Examples:
        >>> from cspm.analysis.sag import analyze_sag
        >>> analyze_sag(linear_density=1e-3).cables[0].sag < 1e-3
        True
    """
    return sag_of(analyzed_machine(scenario, testbed, pose), linear_density)


def sag_of(machine: AnalyzedMachine, linear_density: float | None) -> SagAnalysis:
    """Return the analysis of a machine; see `analyze_sag`."""
    densities = _densities(machine.testbed, linear_density)
    cables = sagging_cables(machine.testbed, machine.pose, np.array(densities))
    return SagAnalysis(machine, densities, cables)


def _densities(testbed: Testbed, linear_density: float | None) -> tuple[float, ...]:
    names = testbed.cable_names
    if linear_density is not None:
        if not (np.isfinite(linear_density) and linear_density > 0.0):
            raise InputError(f"linear density {linear_density:g} kg/m: allowed: above 0")
        return (linear_density,) * len(names)
    found = dict.fromkeys(names, 0.0)
    for entry in testbed.effects:
        if entry.effect == SAG:
            for name in entry.elements or names:
                found[name] = entry.numbers["linear_density"]
    missing = [name for name, density in found.items() if not density > 0.0]
    if missing:
        raise InputError(
            f"{testbed.name}: no linear density of {missing[0]}, allowed: --linear-density KG_PER_M"
            f" for all cables, or the effect {SAG} on each in the test-bed file"
        )
    return tuple(found.values())
