"""How well the bar follows its reference in a run, and what the cables bear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_bringup.assembly import Assembly, assemble, motions_of, resolve
from cspm_bringup.bundle import Bundle, make_bundle
from cspm_bringup.loop import Loop
from cspm_msgs_py.errors import DivergenceError
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import EffectEntry, load_testbed
from cspm_sim.motion import Motion

Array = NDArray[np.float64]
SCENARIOS = Path(__file__).resolve().parents[1] / "scenarios"


@dataclass(frozen=True)
class Case:
    """One run.

    Attributes:
        scenario: name in the library.
        overrides: as for `--set`.
        effects: (effect, elements, parameters) that the plant has and the controllers do not know.
        plant: by name.
        pose_delay: of the motion capture [s], which the test-bed's file says.
    """

    scenario: str
    overrides: tuple[str, ...] = ()
    effects: tuple[tuple[str, tuple[str, ...], Mapping[str, float]], ...] = ()
    plant: str = "sim"
    pose_delay: float = 0.0

    def bundle(self) -> Bundle:
        """Return what is run."""
        path = SCENARIOS / f"{self.scenario}.yaml"
        scenario = load_scenario(path, self.overrides)
        file = load_testbed(path.parent / scenario.testbed)
        entries = tuple(
            EffectEntry(effect=effect, elements=elements, parameters=dict(parameters))
            for effect, elements, parameters in self.effects
        )
        changes: dict[str, object] = {"effects": (*file.testbed.effects, *entries)}
        if self.pose_delay:
            changes["sensors"] = {
                name: sensor.model_copy(
                    update={"delay": self.pose_delay} if name.endswith("/pose") else {}
                )
                for name, sensor in file.testbed.sensors.items()
            }
        machine = file.testbed.model_copy(update=changes)
        described = replace(file, testbed=machine)
        bundle = make_bundle(resolve(scenario, machine), described, path.parent)
        return replace(bundle, plant=self.plant)


@dataclass(frozen=True)
class Tracking:
    """Errors reference − pose (6,) [m, rad] and tensions [N] of a run.

    Attributes:
        duration: simulated [s], less than the scenario's where the run failed.
        failure: what ended it early, empty for nothing.
        rms: root mean square.
        largest: largest absolute value.
        within: share of time within the scenario's requirement, in all controlled coordinates.
        tensions: lowest and highest of any cable.
        slack: share of time with any cable at zero.
        not_met: share of time with the wanted wrench not met.
    """

    duration: float
    failure: str
    rms: Sequence[float]
    largest: Sequence[float]
    within: float
    tensions: Sequence[float]
    slack: float
    not_met: float

    def data(self) -> dict[str, object]:
        """Return it as plain data."""
        return asdict(self)


def assembled(bundle: Bundle) -> Assembly:
    """Return the parts of a run."""
    with bundle.unpacked() as place:
        return assemble(bundle.scenario, bundle.testbed.testbed, place, bundle.plant)


def motions_of_bundle(bundle: Bundle) -> dict[str, Motion]:
    """Return the prescribed motions of a run by reference topic."""
    with bundle.unpacked() as place:
        return motions_of(bundle.scenario, bundle.testbed.testbed, place)


def follow(bundle: Bundle) -> tuple[Array, Array, Array, str]:
    """Run, and return errors (n, 6), tensions (n, cables), wrench not met (n,), and the failure."""
    parts = assembled(bundle)
    steps = round(bundle.scenario.duration * bundle.scenario.rates.plant)
    alarms: list[str] = []
    loop = Loop(parts, {}, lambda _, status: alarms.extend([status.message] * (status.level == 2)))
    reference, plant = parts.references["/bar/reference"], parts.plant
    errors, tensions = np.empty((steps, 6)), np.empty((steps, len(plant.tensions)))
    missed = np.zeros(steps, dtype=bool)
    for k in range(steps):
        errors[k], tensions[k] = -plant.bar_state[:6], plant.tensions
        try:
            loop.step()
        except DivergenceError as err:
            return errors[:k], tensions[:k], missed[:k], str(err)
        errors[k] += reference.values[:6]
        missed[k] = loop.infeasible
        if alarms:
            return errors[: k + 1], tensions[: k + 1], missed[: k + 1], alarms[0]
    return errors, tensions, missed, ""


def track(case: Case) -> Tracking:
    """Run a case and sum it up."""
    bundle = case.bundle()
    errors, tensions, missed, failure = follow(bundle)
    return Tracking(
        duration=len(errors) / bundle.scenario.rates.plant,
        failure=failure,
        rms=np.sqrt((errors**2).mean(axis=0)).tolist(),
        largest=np.abs(errors).max(axis=0).tolist(),
        within=float(within_requirement(bundle, errors).mean()),
        tensions=[float(tensions.min()), float(tensions.max())],
        slack=float((tensions <= 0.0).any(axis=1).mean()),
        not_met=float(missed.mean()),
    )


def within_requirement(bundle: Bundle, errors: Array) -> NDArray[np.bool_]:
    """Return when all controlled coordinates are within the scenario's requirement, (n,)."""
    wanted = bundle.scenario.requirement
    limits = np.array([wanted.position] * 3 + [wanted.angle] * 3)
    dofs = getattr(bundle.scenario.control, "motion").dofs  # noqa: B009 - closed loops only
    if "roll" not in dofs:
        limits[3] = np.inf
    return np.asarray((np.abs(errors) <= limits).all(axis=1))
