"""A stage whose steps compiled code makes, for nodes that step one stage each."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cspm_control.phases.make import stage_phase
from cspm_model.kernels.native import caller_of
from cspm_model.phase import DONE, PHASE, Phase, Places, Slots
from cspm_msgs_py.diagnostics import Status
from cspm_msgs_py.schedule import NodePlan
from cspm_msgs_py.stepping.stage import Send, Stage
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]

_call_phase = caller_of(PHASE)


@njit(cache=True, error_model="numpy", _nrt=False)
def _call(address: int, step: int, row: Array, places: Places) -> int:
    return int(_call_phase(address, step, row, places))


class CompiledStage:
    """Steps a stage by its phase, and by its Python where that has to look.

    Python makes the first step, every one before all inputs came, and those in the safe state.
    """

    def __init__(
        self, stage: Stage, phase: Phase, slots: Slots, plan: NodePlan, period_ns: int
    ) -> None:
        """Take a stage and its phase; see `compiled_stage`."""
        self._stage, self._phase, self._slots = stage, phase, slots
        self._period_ns = period_ns
        self._inputs = [(name, slots[name]) for name in (*plan.inputs, *plan.held)]
        self._row = np.zeros(slots.width)
        self._outputs = [(name, self._row[slots[name]]) for name in plan.outputs]
        # Whether it made a step, and whether Python has changed it since its phase was made.
        self._has_begun, self._changed = False, True

    @property
    def node(self) -> str:
        """Name of the node that it is."""
        return self._stage.node

    def status(self) -> Status:
        """Return what happened since the last call."""
        return self._stage.status()

    def step(self, now_ns: int, inputs: Mapping[str, Array], send: Send) -> None:
        """Compute once from the latest rows by topic; see `Stage`.

        Raises:
            ControllerError: as the stage itself.
        """
        if self._has_begun and self._phase.ready() and self._compute(now_ns, inputs):
            for topic, row in self._outputs:
                send(topic, row)
            return
        self._stage.step(now_ns, inputs, send)
        self._has_begun = self._changed = True

    def _compute(self, now_ns: int, inputs: Mapping[str, Array]) -> bool:
        """Let compiled code compute; return whether it did."""
        for name, columns in self._inputs:
            if name not in inputs:
                return False
            self._row[columns] = inputs[name]
        if self._changed:
            phase = stage_phase(self._stage, self._slots, self._period_ns)
            if phase is None:
                return False
            self._phase, self._changed = phase, False
        phase = self._phase
        step = now_ns // self._period_ns
        return bool(_call(phase.address, step, self._row, phase.places) == DONE)


def compiled_stage(
    stage: Stage, plan: NodePlan, topics: Mapping[str, Topic], period_ns: int
) -> Stage:
    """Return what steps a stage in compiled code, the stage itself where it has none.

    Args:
        stage: the controller.
        plan: what it reads and sends.
        topics: of the test-bed, by name.
        period_ns: of a step; each instant is a multiple of it [ns].
    """
    slots = Slots()
    names = dict.fromkeys((*plan.inputs, *plan.held, *plan.outputs))
    slots.add({name: topics[name].width for name in names})
    phase = stage_phase(stage, slots, period_ns)
    return stage if phase is None else CompiledStage(stage, phase, slots, plan, period_ns)
