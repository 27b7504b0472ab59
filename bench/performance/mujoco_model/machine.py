"""The nearest thing to the thesis's machine in MuJoCo: a free body on eight spatial tendons.

Its frame stands still where the plant's is at first, its tendons are linear and of constant rest
length, and it has no winches: 13 states instead of 36. Stiffness and damping are the tangents of
the plant's laws where it hangs; a range of rest lengths from 0 makes the tendons go slack instead
of pushing.
"""

from __future__ import annotations

import mujoco
import numpy as np

from cspm_model.kernels.cable import (
    ATTACHMENT,
    DAMPING_CONSTANT,
    DAMPING_SLOPE,
    EXIT,
    OFFSET_LENGTH,
    elastic_tension,
    law_scale,
)
from cspm_model.kernels.rotation import rotate, rotation_from_euler
from cspm_msgs_py.testbed import Bar
from cspm_sim.plant import Plant

TIMESTEP = 1e-3
# What sets the body in motion: [m/s], [rad/s].
PUSH = (0.02, 0.02, 0.02, 0.05, 0.05, 0.05)


class MujocoMachine:
    """A MuJoCo model and its state.

    Attributes:
        data: the state.
    """

    def __init__(self, plant: Plant, integrator: str, *, pulled: bool = False) -> None:
        """Hang the bar of `plant` where it hangs now; `integrator` as MuJoCo calls it.

        With `pulled` the tendons pull by `data.ctrl` [N] more than their springs do.
        """
        text = _description(plant, integrator, pulled=pulled)
        self._model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self._model)

    def rewind(self) -> None:
        """Go back to the first instant."""
        mujoco.mj_resetData(self._model, self.data)
        self.data.qvel[:] = PUSH

    def advance(self, steps: int) -> None:
        """Make `steps` steps in one call."""
        mujoco.mj_step(self._model, self.data, nstep=steps)

    def least_stretch(self, steps: int) -> float:
        """Return the least elongation of any tendon at any of the first `steps` steps [m]."""
        self.rewind()
        least = np.inf
        for _ in range(steps):
            self.advance(1)
            stretch = self.data.ten_length - self._model.tendon_lengthspring[:, 1]
            least = min(least, float(stretch.min()))
        return least


def _description(plant: Plant, integrator: str, *, pulled: bool) -> str:
    bar = plant.testbed.bar
    if bar is None:
        raise ValueError("a machine with a bar is needed")
    gravity = plant.testbed.gravity
    cables = range(len(plant.tensions))
    rows = plant.parameters.cables
    exits = "".join(_site(f"exit{i}", _exit(plant, i)) for i in cables)
    ends = "".join(_site(f"end{i}", rows[i, ATTACHMENT : ATTACHMENT + 3]) for i in cables)
    return f"""<mujoco>
      <option timestep="{TIMESTEP}" integrator="{integrator}" gravity="0 0 {gravity}"/>
      <worldbody>{exits}
        <body pos="{_numbers(plant.bar_state[:3])}"><freejoint/>{_inertial(bar)}{ends}</body>
      </worldbody>
      <tendon>{"".join(_tendon(plant, i) for i in cables)}</tendon>
      <actuator>{"".join(_pull(i) for i in cables) if pulled else ""}</actuator>
    </mujoco>"""


def _exit(plant: Plant, i: int) -> np.ndarray:
    rotation = rotation_from_euler(*plant.frame[3:6])
    x, y, z = plant.parameters.cables[i, EXIT : EXIT + 3]
    place: np.ndarray = plant.frame[:3] + np.array(rotate(rotation, x, y, z))
    return place


def _inertial(bar: Bar) -> str:
    inertia = bar.inertia
    full = (inertia.ixx, inertia.iyy, inertia.izz, inertia.ixy, inertia.ixz, inertia.iyz)
    return f'<inertial pos="{_numbers(bar.com)}" mass="{bar.mass}" fullinertia="{_numbers(full)}"/>'


def _pull(i: int) -> str:
    # A motor's force lengthens a tendon.
    return f'<motor tendon="cable{i}" gear="-1"/>'


def _tendon(plant: Plant, i: int) -> str:
    rows, tables = plant.parameters.cables, plant.parameters.tables
    elastic_length = plant.unstretched_lengths[i] + rows[i, OFFSET_LENGTH]
    elongation = plant.lengths[i] - plant.unstretched_lengths[i]
    scale = law_scale(elastic_length, rows, i)
    tension, stiffness = elastic_tension(elongation, elastic_length, scale, rows, tables, i)
    damping = rows[i, DAMPING_CONSTANT] - rows[i, DAMPING_SLOPE] * elastic_length
    rest = plant.lengths[i] - tension / stiffness
    return (
        f'<spatial name="cable{i}" stiffness="{stiffness}" damping="{damping}"'
        f' springlength="0 {rest}">'
        f'<site site="exit{i}"/><site site="end{i}"/></spatial>'
    )


def _site(name: str, place: np.ndarray) -> str:
    return f'<site name="{name}" pos="{_numbers(place)}"/>'


def _numbers(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values, dtype=float))
