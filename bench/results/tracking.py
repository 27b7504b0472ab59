"""How well the bar follows its reference in a run, and what the cables bear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_model.kernels.bar import MASS
from cspm_model.motion import Motion
from cspm_msgs_py.edited import file_of
from cspm_msgs_py.errors import DivergenceError
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.schedule import WAVE_TRAJECTORY
from cspm_msgs_py.testbed import Cable, EffectEntry, ExponentialStiffness, Testbed, load_testbed
from cspm_run.assembly import Assembly, assemble, assemble_stage, resolve
from cspm_run.bundle import Bundle, make_bundle
from cspm_run.library import find_scenario
from cspm_run.loop import Loop
from cspm_run.motions import motions_of
from cspm_sim.plant import Plant

Array = NDArray[np.float64]
Effects = tuple[tuple[str, tuple[str, ...], Mapping[str, float]], ...]
# Errors (n, 6), tensions (n, cables), whether the wrench was infeasible (n,), and the failure.
Run = tuple[Array, Array, NDArray[np.bool_], str]
SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"


@dataclass(frozen=True)
class Case:
    """One run.

    Attributes:
        scenario: name in the library.
        overrides: as for `--set`.
        effects: (effect, elements, parameters) that the plant has, of which controllers read at
            most the friction of winches.
        plant: by name.
        pose_delay: of the motion capture [s], which the test-bed's file says.
        cables: what the file's stiffnesses and dampers are multiplied by.
        reported: effects that controllers read instead of those that the plant has.
        loads: (time [s], mass [kg]) that the bar takes up at its centre of mass, unknown to all.
    """

    scenario: str
    overrides: tuple[str, ...] = ()
    effects: Effects = ()
    plant: str = "sim"
    pose_delay: float = 0.0
    cables: tuple[float, float] = (1.0, 1.0)
    reported: Effects | None = None
    loads: tuple[tuple[float, float], ...] = ()

    def bundle(self) -> Bundle:
        """Return what is run."""
        path = find_scenario(self.scenario)
        scenario = load_scenario(path, self.overrides)
        file = load_testbed(path.parent / scenario.testbed)
        entries = (*file.testbed.effects, *_entries(self.effects))
        changes: dict[str, object] = {"effects": entries}
        changes["cables"] = tuple(_scaled(each, *self.cables) for each in file.testbed.cables)
        if self.pose_delay:
            changes["sensors"] = {
                name: sensor.model_copy(
                    update={"delay": self.pose_delay} if name.endswith("/pose") else {}
                )
                for name, sensor in file.testbed.sensors.items()
            }
        machine = file.testbed.model_copy(update=changes)
        bundle = make_bundle(resolve(scenario, machine), file_of(machine), path.parent)
        return replace(bundle, plant=self.plant)

    def run(self) -> Run:
        """Run it; as `follow`."""
        bundle, believed = self.bundle(), None
        if self.reported is not None:
            machine = bundle.testbed.testbed
            kept = machine.effects[: len(machine.effects) - len(self.effects)]
            believed = machine.model_copy(update={"effects": (*kept, *_entries(self.reported))})
        return follow(bundle, believed, self.loads)


def _entries(effects: Effects) -> tuple[EffectEntry, ...]:
    return tuple(
        EffectEntry(effect=effect, elements=elements, parameters=dict(parameters))
        for effect, elements, parameters in effects
    )


def _scaled(cable: Cable, stiffness: float, damping: float) -> Cable:
    law, damper = cable.stiffness, cable.damping
    if (stiffness, damping) == (1.0, 1.0):
        return cable
    assert isinstance(law, ExponentialStiffness)
    assert damper is not None
    scaled = {"a": stiffness * law.a, "youngs_modulus": stiffness * law.youngs_modulus}
    return cable.model_copy(
        update={
            "stiffness": law.model_copy(update=scaled),
            "damping": damper.model_copy(update={"factor": damping * damper.factor}),
        }
    )


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
        not_met: share of time with the commanded wrench infeasible.
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


def assembled(bundle: Bundle, believed: Testbed | None = None) -> Assembly:
    """Return the parts of a run, with controllers of the machine that is believed to be there."""
    with bundle.unpacked() as place:
        parts = assemble(bundle.scenario, bundle.testbed.testbed, place, bundle.plant)
        if believed is None:
            return parts
        stages = [
            each
            if each.node == WAVE_TRAJECTORY
            else assemble_stage(each.node, bundle.scenario, believed, place)
            for each in parts.stages
        ]
    return replace(parts, stages=stages)


def motions_of_bundle(bundle: Bundle) -> dict[str, Motion]:
    """Return the prescribed motions of a run by reference topic."""
    with bundle.unpacked() as place:
        return motions_of(bundle.scenario, bundle.testbed.testbed, place)


def follow(
    bundle: Bundle, believed: Testbed | None = None, loads: Sequence[tuple[float, float]] = ()
) -> Run:
    """Run, and return errors (n, 6), tensions (n, cables), wrench infeasible (n,), and the failure.

    Controllers are those of the machine that is `believed` to be there; `loads` as of a `Case`.
    """
    parts = assembled(bundle, believed)
    due = {round(time * bundle.scenario.rates.plant): mass for time, mass in loads}
    steps = round(bundle.scenario.duration * bundle.scenario.rates.plant)
    alarms: list[str] = []
    loop = Loop(parts, {}, lambda _, status: alarms.extend([status.message] * (status.level == 2)))
    reference, plant = parts.references["/bar/reference"], parts.plant
    errors, tensions = np.empty((steps, 6)), np.empty((steps, len(plant.tensions)))
    missed = np.zeros(steps, dtype=bool)
    for k in range(steps):
        if k in due:
            assert isinstance(plant, Plant)
            plant.parameters.bar[MASS] += due[k]
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
    errors, tensions, missed, failure = case.run()
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
    dofs = getattr(bundle.scenario.control, "motion").controlled  # noqa: B009 - closed loops only
    if "roll" not in dofs:
        limits[3] = np.inf
    return np.asarray((np.abs(errors) <= limits).all(axis=1))
