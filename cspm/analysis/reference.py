"""Whether a machine can follow its scenario's reference, before anything runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cspm.scenario import AnyScenario, as_scenario
from cspm.simulation import bundle_of
from cspm.testbed import AnyTestbed, as_file
from cspm_control.analysis.reference_demand import ReferenceDemand
from cspm_msgs_py.new_folder import new_folder
from cspm_msgs_py.recording.run_record import SIM
from cspm_msgs_py.testbed import Testbed
from cspm_run.before_run import demanded
from cspm_run.bundle import Bundle

PICTURE = "reference.png"


@dataclass(frozen=True, eq=False, repr=False)
class ReferenceAnalysis:
    """What a reference needs of a machine.

    Attributes:
        name: of the scenario.
        testbed: the machine.
        limits: of tensions, (n, 2) [N].
        demand: tensions, speeds and torques along the reference.
    """

    name: str
    testbed: Testbed
    limits: np.ndarray[Any, np.dtype[np.float64]]
    demand: ReferenceDemand

    @property
    def unmet_share(self) -> float:
        """Share of the time at which no tensions within the limits give the wrench."""
        return float(np.mean(~self.demand.met))

    @property
    def worst(self) -> tuple[float, str] | None:
        """When [s] and in which coordinate most of the wrench is missing; None where all is met."""
        return self.demand.worst

    @property
    def overloaded(self) -> dict[str, float]:
        """Cables whose motor the reference asks for more than its limit, in multiples of it."""
        limits = np.array([cable.torque_limit for cable in self.testbed.cables])
        most = np.abs(self.demand.torques).max(axis=0) / limits
        names = self.testbed.cable_names
        return {name: float(x) for name, x in zip(names, most, strict=True) if x > 1.0}

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm analyze reference --json` writes."""
        columns = zip(self.testbed.cables, *self._extremes(), strict=True)
        worst = None if self.worst is None else {"time": self.worst[0], "dof": self.worst[1]}
        return {
            "scenario": self.name,
            "testbed": self.testbed.name,
            "unmet_share": self.unmet_share,
            "worst": worst,
            "cables": [
                {
                    "name": cable.name,
                    "tension": [low, high],
                    "speed": speed,
                    "torque": torque,
                    "torque_limit": cable.torque_limit,
                }
                for cable, low, high, speed, torque in columns
            ],
        }

    def write(self, folder: str | Path) -> Path:
        """Draw tensions, speeds and torques over time; return the picture's path.

        Args:
            folder: a new one.

        Raises:
            InputError: the folder exists.
        """
        place = new_folder(folder)
        from cspm.plots.reference_figure import draw_reference

        draw_reference(place / PICTURE, self.name, self.testbed, self.limits, self.demand)
        return place / PICTURE

    def _extremes(self) -> tuple[list[float], list[float], list[float], list[float]]:
        """Return lowest and highest tension, highest speed and torque, each by cable."""
        demand = self.demand
        return (
            demand.tensions.min(axis=0).tolist(),
            demand.tensions.max(axis=0).tolist(),
            np.abs(demand.speeds).max(axis=0).tolist(),
            np.abs(demand.torques).max(axis=0).tolist(),
        )


def analyze_reference(
    scenario: AnyScenario, *, testbed: AnyTestbed | None = None
) -> ReferenceAnalysis:
    """Find what a scenario's reference needs of its machine: `cspm analyze reference`.

    Args:
        scenario: whose reference is analysed.
        testbed: a machine instead of the scenario's.

    Raises:
        InputError: no such scenario or test-bed, or a run without a controlled bar.

    Examples:
        >>> from cspm.analysis.reference import analyze_reference
        >>> analyze_reference("ipanema").unmet_share
        0.0
    """
    file = None if testbed is None else as_file(testbed)
    return reference_of(bundle_of(as_scenario(scenario), file, SIM))


def reference_of(bundle: Bundle) -> ReferenceAnalysis:
    """Return the analysis of a run; see `analyze_reference`."""
    limits, demand = demanded(bundle)
    return ReferenceAnalysis(bundle.scenario.name, bundle.testbed.testbed, limits, demand)
