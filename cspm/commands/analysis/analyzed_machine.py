"""The machine and the pose of an analysis, from the command line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cspm.analysis.machine import AnalyzedMachine, analyzed_machine
from cspm.scenario import load_scenario
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario_keys.bodies import ORIGIN, Pose
from cspm_run.library import named_testbed


def read_machine(scenario: str, testbed: Path | None, pose: str | None) -> AnalyzedMachine:
    """Return the machine and pose to analyse.

    Args:
        scenario: a scenario's name or file.
        testbed: a machine instead of the scenario's.
        pose: of the bar, six numbers with commas; None for the design pose of the scenario's
            controllers, or its reference pose.

    Raises:
        InputError: an input cannot be used; names file, key or option, and what is allowed.
    """
    described = load_scenario(scenario)
    file = named_testbed(testbed) if testbed else described.testbed_file
    if file.testbed.bar is None:
        raise InputError(
            f"{testbed or scenario}: machine {file.testbed.name} has no bar, allowed: one with a"
            " bar"
        )
    wanted = None if pose is None else _six(pose, "--pose", "m, rad")
    return analyzed_machine(described, file, wanted)


def read_acceleration(text: str) -> Pose:
    """Return an acceleration per DOF of six numbers with commas [m/s², rad/s²].

    Raises:
        InputError: the text is not six non-negative numbers.
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
