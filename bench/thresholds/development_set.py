"""The fixed recordings on which thresholds are moved, made on demand from fixed seeds."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import dataclass, replace
from pathlib import Path

from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import EffectEntry, load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.library import find_scenario
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
DRY = _effect("winch_coulomb_friction", ("front_left",), torque=0.02)
# Four cables diagnose in half the time of eight. A threshold moves up or down, so that a recording
# is diagnosed some hundred times: all of the set within an hour of processor time.
SET = (
    Development("winch", "one_winch", 47, duration=15.0, capture=None),
    Development(
        "winch_two",
        "one_winch",
        49,
        (DRY_ALL, _effect("tension_gain", gain=1.03)),
        duration=15.0,
        capture=None,
    ),
    Development("healthy", "worst_case_steep", 42, duration=10.0),
    Development("friction", "suspended_four", 43, (DRY,), plant="mujoco", duration=12.0),
    Development(
        "two",
        "suspended_four",
        44,
        (
            _effect("tension_bias", ("rear_left",), bias=0.3),
            _effect("winch_torque_gain", ("front_right",), gain=0.97),
        ),
        duration=10.0,
    ),
    Development("no_cells", "suspended_four", 46, (DRY,), duration=10.0, cells=False),
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
    path = find_scenario(case.scenario)
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
    path = find_scenario(case.scenario)
    described = path.parent / load_scenario(path).testbed
    found = read_measurement(recorded(case, folder), described)
    return found if case.cells else replace(found, tension=None)
