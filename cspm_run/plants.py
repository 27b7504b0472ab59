"""The implementations of the test-bed that a run may be made with."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from importlib.metadata import version as metadata_version

import numpy as np
from numpy.typing import NDArray

from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.installed.extra_library import extra_library
from cspm_msgs_py.recording.run_record import MUJOCO, SIM
from cspm_msgs_py.testbed import Testbed
from cspm_sim.any_plant import AnyPlant

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

    Raises:
        InputError: no such plant, or one that is not installed or cannot be this machine.
        ConvergenceError: no tensions hold the bar at this pose.
    """
    if name == SIM:
        from cspm_sim.plant import Plant

        return Plant(
            testbed,
            frame_motion,
            period_ns,
            bar_pose=bar_pose,
            tensions=tensions,
            locked=locked,
            cuts=cuts,
        )
    if name != MUJOCO:
        raise InputError(f"plant {name}: allowed: {', '.join(PLANTS)}")
    require_mujoco(f"plant {name}")
    refuse_cuts(name, cuts)
    from cspm_sim.mujoco.plant import MujocoPlant

    motion = frame_motion.at
    return MujocoPlant(
        testbed, motion, period_ns, bar_pose=bar_pose, tensions=tensions, locked=locked
    )


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
