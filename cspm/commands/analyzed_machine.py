"""The machine and the pose that an analysis is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import ORIGIN, ClosedLoop, Pose, Scenario, load_scenario
from cspm_msgs_py.testbed import Testbed, load_testbed
from cspm_run.library import find_scenario

# The pose at which the thesis analyses its machine, and the name of its test-bed file.
THESIS_POSE: Pose = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)
THESIS_MACHINE = "thesis"


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
        return self.testbed.name == THESIS_MACHINE and bool(np.allclose(self.pose, THESIS_POSE))


def read_machine(scenario: str, testbed: Path | None, pose: str | None) -> AnalyzedMachine:
    """Return what is to be analysed.

    Args:
        scenario: a scenario's name or file.
        testbed: a machine instead of the scenario's.
        pose: of the bar, six numbers with commas; otherwise where the scenario's controllers are
            designed, or where its bar is wanted.

    Raises:
        InputError: naming file, key or option, and what is allowed.
    """
    path = find_scenario(scenario)
    described = load_scenario(path)
    machine = load_testbed(testbed or path.parent / described.testbed).testbed
    if machine.bar is None:
        raise InputError(
            f"{testbed or scenario}: machine {machine.name} has no bar, allowed: one with a bar"
        )
    control = described.control
    wanted = described.bar_mean_pose
    if isinstance(control, ClosedLoop):
        wanted = control.motion.design_pose
    if pose is not None:
        wanted = _six(pose, "--pose", "m, rad")
    return AnalyzedMachine(machine, described, path.parent, wanted)


def read_acceleration(text: str) -> Pose:
    """Return an acceleration per DOF of six numbers with commas [m/s², rad/s²].

    Raises:
        InputError: it is not six numbers that are not negative.
    """
    found = _six(text, "--acceleration", "m/s², rad/s²")
    if min(found) < 0.0:
        raise InputError(f"--acceleration {text}: allowed: six numbers that are not negative")
    return found


def _six(text: str, option: str, units: str) -> Pose:
    try:
        numbers: Sequence[float] = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != len(ORIGIN) or not np.isfinite(numbers).all():
        raise InputError(
            f"{option} {text}: allowed: six numbers with commas, {', '.join(DOFS)} [{units}], such"
            " as 0,0,2,0,0,0"
        )
    a, b, c, d, e, f = numbers
    return a, b, c, d, e, f
