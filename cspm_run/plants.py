"""The implementations of the test-bed that a run may be made with."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from importlib.metadata import version as metadata_version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library
from cspm_msgs_py.recording.run_record import FMU, MUJOCO, SIM
from cspm_msgs_py.testbed import Testbed
from cspm_sim.any_plant import AnyPlant
from cspm_sim.fmu.unit_file import names_unit, read_unit_file

if TYPE_CHECKING:
    from cspm_sim.plant import Plant

Array = NDArray[np.float64]

PLANTS = (SIM, MUJOCO)
# Earlier ones end the process when a control callback fails, and integrate damping otherwise.
OLDEST_MUJOCO = 4


def make_plant(
    name: str,
    testbed: Testbed,
    frame_motion: Motion,
    period_ns: int,
    *,
    bar_pose: Array | None,
    tensions: Array | None,
    locked: bool,
    cuts: Mapping[int, Sequence[int]],
) -> AnyPlant:
    """Return the plant of this name, at rest; see `cspm_sim.plant.Plant` for the arguments.

    A file is a unit of FMI 2, or names one; see `cspm_sim.fmu.unit_file`.

    Raises:
        InputError: no such plant, or one that is not installed or cannot be this machine.
        ConvergenceError: no tensions hold the bar at this pose.
    """
    if name == FMU:
        raise InputError(
            "plant fmu: a recording carries no unit, allowed: one that was made with plant"
            f" {' or '.join(PLANTS)}"
        )
    if name == SIM or names_unit(name):
        from cspm_sim.plant import Plant

        own = Plant(
            testbed,
            frame_motion,
            period_ns,
            bar_pose=bar_pose,
            tensions=tensions,
            locked=locked,
            cuts=cuts,
        )
        return own if name == SIM else _unit(name, own, cuts)
    if name != MUJOCO:
        raise InputError(f"plant {name}: allowed: {', '.join(PLANTS)}")
    require_mujoco(f"plant {name}")
    refuse_cuts(name, cuts)
    from cspm_sim.mujoco.plant import MujocoPlant

    motion = frame_motion.at
    return MujocoPlant(
        testbed, motion, period_ns, bar_pose=bar_pose, tensions=tensions, locked=locked
    )


def _unit(name: str, rest: Plant, cuts: Collection[object]) -> AnyPlant:
    """Return the unit that a file is or names, in the place of a plant at rest."""
    from cspm_sim.fmu.plant import FmuPlant

    refuse_cuts(name, cuts)
    return FmuPlant(read_unit_file(Path(name)), rest)


def recorded_plant(plant: str) -> dict[str, str]:
    """Return what a recording says of the plant that made it."""
    if not names_unit(plant):
        return {"plant": plant}
    found = read_unit_file(Path(plant))
    return {"plant": FMU, "fmu": found.fmu.name, "fmu_sha256": found.sha256}


def check_plant_name(plant: str, option: str, *, more: Collection[str] = ()) -> None:
    """Refuse a plant that is none of `PLANTS`, of `more`, and no unit's file that is there.

    Raises:
        InputError: in one line that begins with the `option`.
    """
    if names_unit(plant):
        read_unit_file(Path(plant))
    elif plant not in (*PLANTS, *more):
        raise InputError(
            f"{option} {plant}: allowed: {', '.join((*PLANTS, *more))}, or a file: a unit of FMI"
            " 2, or the list of names in one"
        )


def check_unit_mode(plant: str, mode: str, option: str, allowed: str) -> None:
    """Refuse a unit in a mode in which nodes make the plant.

    Raises:
        InputError: in one line that begins with the `option`.
    """
    if names_unit(plant) and mode != allowed:
        raise InputError(f"{option} {plant} in mode {mode}: allowed: mode {allowed}")


def refuse_cuts(plant: str, cuts: Collection[object]) -> None:
    """Refuse cuts where nothing can cut a cable.

    Raises:
        InputError: there are any.
    """
    if cuts:
        raise InputError(f"events: plant {plant} cannot cut a cable, allowed: none, or plant {SIM}")


def require_mujoco(what: str) -> None:
    """Refuse `what` where MuJoCo is absent or too old.

    Raises:
        InputError: it is.
    """
    extra_library("mujoco", "mujoco", what)
    found = metadata_version("mujoco")
    if int(found.split(".")[0]) < OLDEST_MUJOCO:
        raise InputError(
            f"{what}: MuJoCo {found} is installed, allowed: {OLDEST_MUJOCO}.0 or newer, which"
            " needs Python 3.11 or newer"
        )
