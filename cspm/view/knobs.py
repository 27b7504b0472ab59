"""What somebody who watches a run may turn, and the run that follows from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.motion_spec import JonswapMotion
from cspm_msgs_py.scenario import ClosedLoop, Scenario
from cspm_run.bundle import Bundle

GAIN, SEA, PACE = "gain", "sea", "pace"
_EFFECT = "effect "


@dataclass(frozen=True)
class Knob:
    """One thing to turn.

    Attributes:
        name: for the program.
        words: for people.
        kind: `range`, or `switch`.
        value: as it is set.
        low, high, step: of a range.
        unit: shown behind the value.
    """

    name: str
    words: str
    kind: str
    value: float | bool
    low: float = 0.0
    high: float = 1.0
    step: float = 0.05
    unit: str = ""

    def data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)

    def at(self, value: object) -> Knob:
        """Return it with another value.

        Raises:
            InputError: the value is none that it can have.
        """
        is_switch = self.kind == "switch"
        right = isinstance(value, bool) == is_switch and isinstance(value, (int, float))
        if not right or not (is_switch or self.low <= float(value) <= self.high):  # type: ignore[arg-type]
            allowed = "true, false" if is_switch else f"{self.low:g} to {self.high:g}"
            raise InputError(f"{self.name}: {value!r}, allowed: {allowed}")
        return replace(self, value=value)  # type: ignore[arg-type]


def knobs_of(scenario: Scenario, effects: Sequence[str], *, paced: bool) -> list[Knob]:
    """Return what may be turned in a scenario's run.

    Args:
        scenario: resolved.
        effects: physics planted in the machine, each of which may be switched off.
        paced: whether the run waits for the clock.
    """
    found = []
    if paced:
        found.append(Knob(PACE, "Pace", "range", 1.0, 0.25, 10.0, 0.25, "× real time"))
    control = scenario.control
    if isinstance(control, ClosedLoop) and getattr(control.motion, "gains", None):
        found.append(Knob(GAIN, "Motion gains", "range", 1.0, 0.1, 2.0, 0.05, "×"))
    bodies = (scenario.winch_frame.motion, scenario.target.motion)
    if any(isinstance(motion, JonswapMotion) for motion in bodies):
        found.append(Knob(SEA, "Sea", "range", 1.0, 0.0, 1.5, 0.05, "×"))
    return found + [Knob(f"{_EFFECT}{each}", each, "switch", True) for each in effects]


def effects_on(knobs: Sequence[Knob]) -> list[str]:
    """Return the effects that are switched on."""
    return [
        each.name.removeprefix(_EFFECT)
        for each in knobs
        if each.name.startswith(_EFFECT) and each.value
    ]


def turned(bundle: Bundle, knobs: Sequence[Knob]) -> Bundle:
    """Return a run with the gains of its motion controller and its sea scaled as knobs say.

    Its recording carries the scenario with these numbers, and is repeated from them.
    """
    values = {each.name: float(each.value) for each in knobs}
    scenario, gain = bundle.scenario, values.get(GAIN, 1.0)
    if gain != 1.0 and isinstance(scenario.control, ClosedLoop):
        motion = scenario.control.motion
        gains = {
            dof: each.model_copy(update={name: gain * number for name, number in each})
            for dof, each in (getattr(motion, "gains", None) or {}).items()
        }
        motion = motion.model_copy(update={"gains": gains})
        control = scenario.control.model_copy(update={"motion": motion})
        scenario = scenario.model_copy(update={"control": control})
    if values.get(SEA, 1.0) != 1.0:
        scenario = _in_another_sea(scenario, values[SEA])
    return replace(bundle, scenario=scenario)


def _in_another_sea(scenario: Scenario, factor: float) -> Scenario:
    changes = {}
    for role, body in (("winch_frame", scenario.winch_frame), ("target", scenario.target)):
        if isinstance(body.motion, JonswapMotion):
            scaled = tuple(factor * each for each in body.motion.amplitudes)
            motion = body.motion.model_copy(update={"amplitudes": scaled})
            changes[role] = body.model_copy(update={"motion": motion})
    return scenario.model_copy(update=changes)
