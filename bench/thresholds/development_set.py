"""The fixed recordings on which thresholds are moved, made on demand from fixed seeds."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

from bench.performance.thesis_machine import SCENARIOS
from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import EffectEntry, load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.recorded_run import run


@dataclass(frozen=True)
class Development:
    """A recording whose effects are known.

    Attributes:
        name: of it.
        scenario: name of a scenario file.
        seed: of sea and sensors.
        planted: effects of the plant that the test-bed file does not have.
        plant: `sim` or `mujoco`.
        duration: [s].
        capture: rate of the motion capture [Hz], none on a rig.
        cells: whether load cells were recorded.
    """

    name: str
    scenario: str
    seed: int
    planted: tuple[EffectEntry, ...] = ()
    plant: str = "sim"
    duration: float = 14.0
    capture: int | None = 100
    cells: bool = True

    @property
    def key(self) -> str:
        """Name of its folders: another as soon as anything of it is another."""
        return f"{self.name}-{hashlib.sha256(repr(self).encode()).hexdigest()[:8]}"


def _effect(effect: str, elements: tuple[str, ...] = (), **parameters: float) -> EffectEntry:
    return EffectEntry(effect=effect, elements=elements, parameters=parameters)


DRY_ALL = _effect("winch_coulomb_friction", torque=0.02)
DRY = _effect("winch_coulomb_friction", ("surge_2",), torque=0.02)
SET = (
    Development("winch", "one_winch", 47, duration=15.0, capture=None),
    Development("winch_friction", "one_winch", 48, (DRY_ALL,), duration=15.0, capture=None),
    Development(
        "winch_two",
        "one_winch",
        49,
        (DRY_ALL, _effect("tension_gain", gain=1.03)),
        duration=15.0,
        capture=None,
    ),
    Development(
        "rig",
        "rig_damping_surge",
        41,
        (DRY_ALL, _effect("tension_gain", gain=1.02)),
        duration=24.0,
        capture=None,
    ),
    Development("healthy", "worst_case", 42, plant="mujoco"),
    Development("friction", "worst_case", 43, (DRY,), plant="mujoco"),
    Development(
        "two",
        "worst_case",
        44,
        (
            _effect("tension_bias", ("hoist_1",), bias=0.3),
            _effect("winch_torque_gain", ("surge_1",), gain=0.97),
        ),
    ),
    Development(
        "stiffness", "worst_case", 45, (_effect("cable_stiffness", ("hoist_1",), scale=0.85),)
    ),
    Development("no_cells", "worst_case", 46, (DRY,), cells=False),
)


def case_of(name: str) -> Development:
    """Return the case of `SET` with a name."""
    (case,) = (each for each in SET if each.name == name)
    return case


def recorded(case: Development, folder: Path) -> Path:
    """Return the recording of a case in a folder, made if it is not there yet.

    Args:
        case: of `SET`.
        folder: of all recordings.
    """
    place = folder / case.key
    if place.is_dir():
        return place
    unfinished = folder / f".{case.key}"
    shutil.rmtree(unfinished, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    path = SCENARIOS / f"{case.scenario}.yaml"
    capture = [] if case.capture is None else [f"rates.motion_capture={case.capture}"]
    wanted = [f"duration={case.duration:g}", f"seed={case.seed}", *capture]
    scenario = load_scenario(path, wanted)
    file = load_testbed(path.parent / scenario.testbed)
    effects = (*file.testbed.effects, *case.planted)
    machine = file.testbed.model_copy(update={"effects": effects})
    described = make_bundle(resolve(scenario, machine), file, path.parent)
    bundle = described.concealing(machine)
    run(replace(bundle, plant=case.plant), unfinished)
    unfinished.rename(place)
    return place


def measured(case: Development, folder: Path) -> Measurement:
    """Return what a case recorded, with the machine as its file describes it.

    Args:
        case: of `SET`.
        folder: of all recordings.
    """
    scenario = load_scenario(SCENARIOS / f"{case.scenario}.yaml")
    found = read_measurement(recorded(case, folder), SCENARIOS / scenario.testbed)
    return found if case.cells else replace(found, tension=None)
