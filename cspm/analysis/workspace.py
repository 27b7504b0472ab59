"""Where cables can hold the bar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm.analysis.machine import DEFAULT_SCENARIO, AnalyzedMachine, analyzed_machine, six
from cspm.progress import Progress, shows_progress, silent
from cspm.scenario import AnyScenario
from cspm.testbed import AnyTestbed
from cspm_control.analysis.cable_structure import cable_structure
from cspm_control.analysis.claim import Claim
from cspm_control.analysis.pose_grid import Grid, workspace_grids
from cspm_control.analysis.published_workspace import workspace_claims
from cspm_control.analysis.workspace import ALGORITHMS
from cspm_control.analysis.workspace_limits import LIMITED
from cspm_control.analysis.workspace_result import (
    ACCELERATED,
    FEASIBLE,
    WorkspaceResult,
    analyse_workspace,
)
from cspm_control.waves.build import build_motion
from cspm_msgs_py.errors import CspmError, InputError
from cspm_msgs_py.new_folder import new_folder
from cspm_run.assembly import resolve
from cspm_run.stability.stable_region import stable_limits

PICTURES = ("workspace.png", "maps.png")


@dataclass(frozen=True, eq=False, repr=False)
class Workspace:
    """Where cables can hold the bar.

    Attributes:
        machine: what was analysed, and where.
        result: limits per DOF, whole grids, maps, internal.
        coarse: every so-manieth value of each DOF of the whole grids was taken.
        claims: the thesis's figures beside ours, where they are of this machine at this pose.
        stable: how far each DOF goes alone until the scenario's gains, fixed, are not stable
            together [m, rad]; None: not even here, or no loops that can be followed.
    """

    machine: AnalyzedMachine
    result: WorkspaceResult
    coarse: int
    claims: tuple[Claim, ...]
    stable: dict[str, float | None]

    @property
    def limits(self) -> dict[str, dict[str, float | None]]:
        """How far the bar goes in one DOF alone [m, rad], by way; None: not even this pose.

        Ways: `pseudo_inverse` and `general`, tensions not negative; `wrench_feasible`, above the
        lowest tension; `accelerated`, with room for the acceleration.
        """
        return {way: dict(found) for way, found in self.result.limits.items()}

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm analyze workspace --json` writes."""
        found = _data(self.machine, self.result, self.claims, self.coarse)
        return found | {"limits_stable": self.stable}

    def write(self, folder: str | Path) -> tuple[Path, ...]:
        """Draw the workspace and maps over it; return the pictures' paths.

        Args:
            folder: a new one.

        Raises:
            InputError: the folder exists.
        """
        place = new_folder(folder)
        from cspm.plots.workspace_figure import draw_maps, draw_workspace

        draw_workspace(place / PICTURES[0], self.result)
        draw_maps(place / PICTURES[1], self.result)
        return tuple(place / name for name in PICTURES)


@shows_progress("searching")
def analyze_workspace(
    scenario: AnyScenario = DEFAULT_SCENARIO,
    *,
    testbed: AnyTestbed | None = None,
    pose: Sequence[float] | None = None,
    acceleration: Sequence[float] | None = None,
    coarse: int = 1,
    progress: Progress = silent,
) -> Workspace:
    """Find where cables can hold the bar: `cspm analyze workspace`.

    Args:
        scenario: whose machine is analysed.
        testbed: a machine instead of the scenario's.
        pose: of the bar, x y z φ θ ψ in world_ned [m, rad]; None: where controllers are designed.
        acceleration: required either way (6,) [m/s², rad/s²]; None: the RMS of the reference.
        coarse: take every so-manieth value of each DOF of the whole grids, 28.6 million poses.
        progress: called now and then with the share that is done and what is being done;
            none: a bar in a terminal, lines in a notebook.

    Raises:
        InputError: no such scenario or test-bed, a machine without bar, or a negative acceleration.
        CspmError: the machine has no workspace to speak of.
    """
    machine = analyzed_machine(scenario, testbed, pose)
    required = None if acceleration is None else six(acceleration, "acceleration")
    if required is not None and min(required) < 0.0:
        raise InputError(f"acceleration {required}: allowed: six numbers that are not negative")
    if coarse < 1:
        raise InputError(f"coarse {coarse}: allowed: 1 or more")
    sizes = {name: grid.every(coarse).size for name, grid in grids_of(machine).items()}
    done = 0

    def advance(name: str, count: int) -> None:
        nonlocal done
        done += count
        progress(min(1.0, done / sum(sizes.values())), name)

    found = workspace_of(machine, required, coarse, advance, lambda: False)
    assert found is not None
    return found


def grids_of(machine: AnalyzedMachine) -> dict[str, Grid]:
    """Return the whole grid of each algorithm for a machine."""
    structure = cable_structure(machine.testbed, machine.pose)
    return workspace_grids(machine.testbed.name, structure.exits, structure.axes, machine.pose)


def workspace_of(
    machine: AnalyzedMachine,
    acceleration: Sequence[float] | None,
    coarse: int,
    advance: Callable[[str, int], None],
    stopped: Callable[[], bool],
) -> Workspace | None:
    """Return the analysis of a machine, None if stopped; see `analyze_workspace`."""
    required = np.array(acceleration or reference_acceleration(machine))
    found = analyse_workspace(machine.testbed, machine.pose, required, coarse, advance, stopped)
    if found is None:
        return None
    claims = workspace_claims(found) if machine.is_published else []
    return Workspace(machine, found, coarse, tuple(claims), _stable_limits(machine))


def _stable_limits(machine: AnalyzedMachine) -> dict[str, float | None]:
    """Return how far each DOF goes alone with the scenario's gains; none where it has no gains."""
    try:
        designed = resolve(machine.scenario, machine.testbed, machine.folder)
    except CspmError:
        return dict.fromkeys(LIMITED)
    return stable_limits(designed, machine.testbed, grids_of(machine)["general"], machine.pose)


def reference_acceleration(machine: AnalyzedMachine) -> NDArray[np.float64]:
    """Return the RMS acceleration of the scenario's reference of the bar, (6,) [m/s², rad/s²]."""
    scenario = machine.scenario
    motion = build_motion(
        scenario.target.motion,
        scenario.bar_mean_pose,
        seed=scenario.seed,
        duration=scenario.duration,
        gravity=machine.testbed.gravity,
        folder=machine.folder,
    )
    return np.asarray(np.sqrt(np.mean(motion.knots[:, 12:] ** 2, axis=0)))


def _data(
    machine: AnalyzedMachine, found: WorkspaceResult, claims: Sequence[Claim], coarse: int
) -> dict[str, Any]:
    return {
        "testbed": machine.testbed.name,
        "pose": list(found.pose),
        "limits": {name: found.limits[name] for name in ALGORITHMS},
        "limits_with_lowest_tension": found.limits[FEASIBLE],
        "limits_accelerating": found.limits[ACCELERATED],
        "required_acceleration": found.acceleration.tolist(),
        "acceleration_factor": found.factor if np.isfinite(found.factor) else None,
        "coarse": coarse,
        "whole": {name: whole._asdict() for name, whole in found.whole.items()},
        "largest_condition": found.largest_condition,
        "claims": [claim.data() for claim in claims],
    }
