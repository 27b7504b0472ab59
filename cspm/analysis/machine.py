"""The machine and the pose that an analysis is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cspm.scenario import AnyScenario, as_scenario
from cspm.testbed import AnyTestbed, as_file
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import ClosedLoop, Scenario
from cspm_msgs_py.scenario_keys.bodies import ORIGIN, Pose
from cspm_msgs_py.testbed import Testbed

# The pose at which the thesis analyses its machine, and the test-beds that reconstruct it.
THESIS_POSE: Pose = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)
THESIS_MACHINES = ("thesis", "thesis_refitted")
DEFAULT_SCENARIO = "worst_case"


@dataclass(frozen=True)
class AnalyzedMachine:
    """What to analyse.

    Attributes:
        testbed: the machine.
        scenario: where it comes from, unless a test-bed file was named.
        folder: of the scenario file.
        pose: of the bar, x y z φ θ ψ in world_ned [m, rad]; the winch frame is at the origin.
    """

    testbed: Testbed
    scenario: Scenario
    folder: Path
    pose: Pose

    @property
    def is_published(self) -> bool:
        """Whether the thesis's figures are of this machine at this pose."""
        return self.testbed.name in THESIS_MACHINES and bool(np.allclose(self.pose, THESIS_POSE))


def analyzed_machine(
    scenario: AnyScenario, testbed: AnyTestbed | None, pose: Sequence[float] | None
) -> AnalyzedMachine:
    """Return what is to be analysed.

    Args:
        scenario: its machine and rates are analysed.
        testbed: a machine instead of the scenario's.
        pose: of the bar, x y z φ θ ψ [m, rad]; None: where the scenario's controllers are designed,
            or where its bar is wanted.

    Raises:
        InputError: no such scenario or test-bed, a machine without bar, or a pose that is none.
    """
    chosen = as_scenario(scenario)
    file = chosen.testbed_file if testbed is None else as_file(testbed)
    described, machine = chosen.description, file.testbed
    if machine.bar is None:
        where = chosen.path if testbed is None else file.source
        raise InputError(f"{where}: machine {machine.name} has no bar, allowed: one with a bar")
    control = described.control
    wanted = described.bar_mean_pose
    if isinstance(control, ClosedLoop):
        wanted = control.motion.design_pose
    return AnalyzedMachine(
        machine, described, chosen.path.parent, wanted if pose is None else six(pose, "pose")
    )


def six(values: Sequence[float], name: str) -> Pose:
    """Return six finite numbers.

    Raises:
        InputError: they are no such.
    """
    try:
        found = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (len(ORIGIN),) or not np.isfinite(found).all():
        raise InputError(f"{name} {values}: allowed: six numbers, {', '.join(DOFS)} [m, rad]")
    a, b, c, d, e, f = found.tolist()
    return a, b, c, d, e, f
