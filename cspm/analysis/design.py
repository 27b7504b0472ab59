"""A scenario's control loops: margins as designed, as sampled, and as they cascade."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isclose
from pathlib import Path
from typing import Any

import numpy as np

from cspm.analysis.machine import DEFAULT_SCENARIO, AnalyzedMachine, analyzed_machine
from cspm.scenario import AnyScenario
from cspm.testbed import AnyTestbed
from cspm_control.analysis.cable_groups import cable_groups
from cspm_control.analysis.delay_margin import largest_age
from cspm_control.analysis.loop_view import LoopView
from cspm_control.analysis.loops import LoopAnalysis, analyse_loops, pid_law
from cspm_control.analysis.sampled_loops import LoopTiming, timing_of
from cspm_msgs_py.control_spec.force import PiGains
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.new_folder import new_folder
from cspm_msgs_py.scenario import ClosedLoop
from cspm_msgs_py.scenario_keys.drive import TENSION_DRIVE, TORQUE_DRIVE
from cspm_run.assembly import resolve
from cspm_run.stability.loop_growth import period_of_force

PICTURES = ("motion_loops.png", "force_loops.png")
# Gains of cables of one kind that differ by less, as a share, are shown once.
SAME_GAINS = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class Design:
    """A scenario's control loops.

    Attributes:
        machine: what was analysed, and where.
        control: the controllers with their gains.
        timing: periods and delays.
        result: margins of each loop by way of looking at it: `designed`, `sampled`, `cascade`,
            `late`.
    """

    machine: AnalyzedMachine
    control: ClosedLoop
    timing: LoopTiming
    result: LoopAnalysis

    @property
    def groups(self) -> dict[str, str]:
        """Kinds of cables, each with its first cable, and every cable with gains of its own."""
        return gain_groups(self.machine.testbed.cable_names, self.control.force.gains or {})

    @property
    def largest_ages(self) -> dict[str, float]:
        """How old the state may be that a command answers [s], by what the drives take."""
        scenario = self.machine.scenario.model_copy(update={"control": self.control})
        return {
            drive: largest_age(scenario.model_copy(update={"drive": drive}), self.machine.testbed)
            for drive in (TORQUE_DRIVE, TENSION_DRIVE)
        }

    def data(self) -> dict[str, Any]:
        """Return everything as plain data: what `cspm analyze design --json` writes."""
        found = _data(self.machine, self.control, self.result, self.timing)
        ages = {k: age if np.isfinite(age) else None for k, age in self.largest_ages.items()}
        return found | {"largest_age": ages}

    def write(self, folder: str | Path) -> tuple[Path, ...]:
        """Draw the loops; return the pictures' paths.

        Args:
            folder: a new one.

        Raises:
            InputError: the folder exists.
        """
        place = new_folder(folder)
        from cspm.plots.loop_figure import draw_force_loops, draw_motion_loops

        draw_motion_loops(place / PICTURES[0], self.result)
        draw_force_loops(place / PICTURES[1], self.result, list(self.groups.values()))
        return tuple(place / name for name in PICTURES)


def gain_groups(names: Sequence[str], gains: Mapping[str, PiGains]) -> dict[str, str]:
    """Return each kind of cable with its first, and by its own name each that is tuned otherwise.

    Args:
        names: of the cables.
        gains: of the force controllers, by cable.
    """
    found: dict[str, str] = {}
    for kind, (first, *others) in cable_groups(names).items():
        found[kind] = names[first]
        common = gains[names[first]]
        found |= {
            names[i]: names[i]
            for i in others
            if not isclose(gains[names[i]].kp, common.kp, rel_tol=SAME_GAINS)
            or not isclose(
                gains[names[i]].integral_frequency, common.integral_frequency, rel_tol=SAME_GAINS
            )
        }
    return found


def analyze_design(
    scenario: AnyScenario = DEFAULT_SCENARIO,
    *,
    testbed: AnyTestbed | None = None,
    pose: Sequence[float] | None = None,
    computing: float | None = None,
) -> Design:
    """Look at all control loops of a scenario: `cspm analyze design`.

    Args:
        scenario: with its controllers, machine and rates.
        testbed: a machine instead of the scenario's.
        pose: of the bar, x y z φ θ ψ in world_ned [m, rad]; None: where controllers are designed.
        computing: from a measurement to its torque [s]; None: one period of the force controllers.

    Raises:
        InputError: no such scenario or test-bed, or no loops that this can follow.
        CspmError: the bar cannot hang there.
    """
    return design_of(analyzed_machine(scenario, testbed, pose), computing)


def design_of(machine: AnalyzedMachine, computing: float | None) -> Design:
    """Return the analysis of a machine's loops; see `analyze_design`."""
    control, timing = _closed_loop(machine, computing)
    return Design(machine, control, timing, analyse_loops(machine.testbed, control, timing))


def _closed_loop(
    machine: AnalyzedMachine, computing: float | None
) -> tuple[ClosedLoop, LoopTiming]:
    scenario = machine.scenario
    if not isinstance(scenario.control, ClosedLoop):
        raise InputError(
            f"scenario {scenario.name}: control.mode {scenario.control.mode}, allowed: closed_loop"
        )
    designed = resolve(scenario, machine.testbed, machine.folder).control
    assert isinstance(designed, ClosedLoop)
    pid_law(designed)
    # The gains are those of the design pose; how they do is checked here.
    motion = designed.motion.model_copy(update={"design_pose": machine.pose})
    control = designed.model_copy(update={"motion": motion})
    late = period_of_force(scenario) if computing is None else computing
    return control, timing_of(scenario, machine.testbed, late)


def _data(
    machine: AnalyzedMachine, control: ClosedLoop, found: LoopAnalysis, timing: LoopTiming
) -> dict[str, Any]:
    return {
        "scenario": machine.scenario.name,
        "testbed": machine.testbed.name,
        "pose": list(machine.pose),
        "timing": vars(timing),
        "gains": {
            "motion": {d: g.model_dump() for d, g in (pid_law(control).gains or {}).items()},
            "force": {n: g.model_dump() for n, g in (control.force.gains or {}).items()},
        },
        "motion": {way: _views_data(views) for way, views in found.motion.items()},
        "force": {way: _views_data(views) for way, views in found.force.items()},
        "growth": {
            way: {"rate": rate, "frequency": frequency}
            for way, (rate, frequency) in found.growth.items()
        },
    }


def _views_data(views: dict[str, LoopView]) -> dict[str, Any]:
    def plain(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    return {
        name: {key: plain(value) for key, value in view.margins._asdict().items()}
        | {"settling_time": plain(view.settling_time)}
        for name, view in views.items()
    }
