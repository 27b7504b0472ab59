"""A closed loop around MuJoCo: the same controllers in Python, and in a C callback of MuJoCo's.

The machine is `MujocoMachine`'s, whose tendons are springs of constant rest length. Each pulls more
by what is wanted of it beyond the tension in which the bar hangs, since there are no winches. The
force controllers compute their torques all the same. The gains are those of the machine with
winches. Without these they lose the bar after some seconds, so that turns are short.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import mujoco
import numpy as np
from numba import cfunc, types
from numpy.typing import NDArray

from bench.performance.mujoco_model.machine import MujocoMachine
from bench.performance.processor_time import spent
from bench.performance.thesis_machine import PERIOD_NS, shipped
from cspm_control.phases.make import stage_phase
from cspm_model.kernels.native import caller_of, integers_at, places_of, vector_at
from cspm_model.phase import PHASE, Phase, Slots
from cspm_msgs_py.schedule import BAR_POSE, TENSION, TENSION_COMMAND
from cspm_msgs_py.stepping.stage import Stage
from cspm_run.recorded_run import parts_of
from cspm_run.stage_warm_up import rest_rows
from cspm_sim.plant import Plant

Array = NDArray[np.float64]

# How often MuJoCo calls back in a step.
_CALLS = {"RK4": 4, "Euler": 1}
# What the callback counts and where signals are in the row: calls, calls in a step, steps, phases,
# columns of pose, measured and wanted tensions.
CALLS, PER_STEP, STEP, PHASES, POSE, MEASURED, WANTED = range(7)
# Before the phases' places: row, state, controls, tensions at rest, counts and addresses.
_FIRST_PHASE = 6
_call_phase = caller_of(PHASE)


STEPS = 500


def loop_ways() -> Iterator[tuple[str, int, Callable[[], float]]]:
    """Yield each integrator with each kind of controllers, the cables, and what prices it.

    A price is what a simulated second costs of the processor [ms].
    """
    ways = {"Python": MujocoLoop.by_python, "C callbacks": MujocoLoop.by_callback}
    for integrator in _CALLS:
        for name, way in ways.items():
            what = f"MuJoCo, {integrator}, controllers in {name}, no winches"
            yield what, 8, partial(_cost, integrator, way)


def _cost(integrator: str, way: Callable[[MujocoLoop, int], None]) -> float:
    loop = MujocoLoop(integrator)
    loop.by_python(1)
    way(loop, 1)
    return 1e12 * spent(lambda: way(loop, STEPS)) / (STEPS * PERIOD_NS)


class MujocoLoop:
    """Bar, cables and controllers, stepped by MuJoCo; the bar hangs where `rest` has it."""

    def __init__(self, integrator: str) -> None:
        """Hang the bar; `integrator` is "RK4" or "Euler"."""
        bundle = shipped("rest", "duration=10")
        parts = parts_of(bundle)
        assert isinstance(parts.plant, Plant)
        self._machine = MujocoMachine(parts.plant, integrator, pulled=True)
        self._stages, self._slots = parts.stages, Slots()
        topics = bundle.testbed.testbed.topics
        self._slots.add({name: topics[name].width for name in parts.schedule.topics})
        self._row = np.zeros(self._slots.width)
        self._rows = {name: self._row[self._slots[name]] for name in parts.schedule.topics}
        for stage in parts.stages:
            for name, row in rest_rows(stage.node, bundle).items():
                self._rows[name][:] = row
        self._machine.rewind()
        self.ctrl: Array = self._machine.data.ctrl
        self._hanging = parts.plant.tensions.copy()
        self._step, self._per_step = 0, _CALLS[integrator]
        self._callback: Any = None

    @property
    def pose(self) -> Array:
        """The bar's pose, x y z and quaternion x y z w."""
        place = self._machine.data.qpos
        return np.array([*place[:3], *place[4:7], place[3]])

    def by_python(self, steps: int) -> None:
        """Make steps with controllers in Python."""
        for _ in range(steps):
            self._rows[BAR_POSE][:] = self.pose
            self._rows[TENSION][:] = self._hanging + self.ctrl
            for stage in self._stages:
                stage.step(self._step * PERIOD_NS, self._rows, self._take)
            self.ctrl[:] = self._rows[TENSION_COMMAND] - self._hanging
            self._machine.advance(1)
            self._step += 1

    def by_callback(self, steps: int) -> None:
        """Make steps with controllers in compiled code that MuJoCo calls.

        From the first such step on there are no others.
        """
        if self._callback is None:
            self._callback = self._made()
        mujoco.set_mjcb_control(self._callback.ctypes)
        try:
            self._machine.advance(steps)
        finally:
            mujoco.set_mjcb_control(None)

    def _made(self) -> Any:
        """Return what MuJoCo calls."""
        self._phases = [self._phase(stage) for stage in self._stages]
        columns = [self._slots.first(name) for name in (BAR_POSE, TENSION, TENSION_COMMAND)]
        counts = np.array([0, self._per_step, self._step, len(self._phases), *columns])
        addresses = np.array([phase.address for phase in self._phases])
        state = self._machine.data.qpos, self.ctrl, self._hanging
        self._arrays = (self._row, *state, counts, addresses)
        return _callback(places_of((*self._arrays, *(each.places for each in self._phases))))

    def _phase(self, stage: Stage) -> Phase:
        phase = stage_phase(stage, self._slots, PERIOD_NS)
        assert phase is not None
        return phase

    def _take(self, topic: str, row: Array) -> None:
        self._rows[topic][:] = row


def _callback(places: NDArray[np.int64]) -> Any:
    """Return what MuJoCo calls, for arrays that stay where they are."""

    @cfunc(types.void(types.voidptr, types.voidptr))
    def control(_model: int, _data: int) -> None:
        row, qpos, ctrl = vector_at(places, 0), vector_at(places, 1), vector_at(places, 2)
        hanging, counts = vector_at(places, 3), integers_at(places, 4)
        addresses = integers_at(places, 5)
        first = counts[CALLS] % counts[PER_STEP] == 0
        counts[CALLS] += 1
        if first:
            pose, measured, wanted = counts[POSE], counts[MEASURED], counts[WANTED]
            for i in range(3):
                row[pose + i] = qpos[i]
                row[pose + 3 + i] = qpos[4 + i]
            row[pose + 6] = qpos[3]
            for i in range(ctrl.shape[0]):
                row[measured + i] = hanging[i] + ctrl[i]
            for k in range(counts[PHASES]):
                _call_phase(addresses[k], counts[STEP], row, integers_at(places, _FIRST_PHASE + k))
            for i in range(ctrl.shape[0]):
                ctrl[i] = row[wanted + i] - hanging[i]
            counts[STEP] += 1

    return control
