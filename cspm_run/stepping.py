"""The steps of a run: the first ones in Python, then compiled where the plant is our own."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np

from cspm_msgs_py.recording.writer import BLOCK_NS
from cspm_run.compiled.compiled_loop import CompiledLoop, TakeBlock, first_compiled_step
from cspm_run.loop import Loop
from cspm_run.run_statistics import RunStatistics, torque_limits
from cspm_run.stability.saturation import count_at_limit
from cspm_sim.plant import Plant

PROGRESS_STEPS = 50


class Stepping:
    """Steps a run, and measures how long it takes.

    Attributes:
        elapsed: wall time of the steps but the first, without compiling [s].
    """

    def __init__(
        self, loop: Loop, statistics: RunStatistics, take: Mapping[str, TakeBlock], steps: int
    ) -> None:
        """Take the loop, what counts, and how many steps to make.

        Args:
            loop: at its first step.
            statistics: counts every step.
            take: where messages of compiled steps go, by topic.
            steps: of the plant.
        """
        self._loop, self._statistics, self._take, self._steps = loop, statistics, take, steps
        self._limits = torque_limits(loop.parts.testbed)
        self._compiled: CompiledLoop | None = None
        self.elapsed = 0.0

    def run(self, progress: Callable[[float], None], stopped: Callable[[], bool]) -> None:
        """Make all steps, or as many as there are until `stopped`.

        Raises:
            DivergenceError: as `Loop.step`.
        """
        plant = self._loop.simulator.plant
        # The first step of all compiles the kernels; it is no part of the speed.
        self._by_stages(1)
        ready = first_compiled_step(self._loop.schedule)
        while plant.steps < self._steps and not stopped():
            if plant.steps == ready and isinstance(plant, Plant) and not self._has_faults:
                self._begin_compiled()
            began = time.perf_counter()
            try:
                self._advance(min(self._steps, plant.steps + PROGRESS_STEPS))
            finally:
                self.elapsed += time.perf_counter() - began
            progress(plant.time)

    @property
    def _has_faults(self) -> bool:
        """Whether something can fail, which the compiled steps know nothing of."""
        return self._loop.simulator.faults is not None

    def history(self) -> str:
        """Return what preceded the present instant, in words."""
        return (self._compiled or self._loop).history()

    def _begin_compiled(self) -> None:
        self._compiled = CompiledLoop(self._loop, self._statistics, self._take, BLOCK_NS)

    def _advance(self, end: int) -> None:
        if self._compiled is not None:
            self._compiled.advance(end)
            return
        plant, ready = self._loop.simulator.plant, first_compiled_step(self._loop.schedule)
        self._by_stages(min(end, ready) if plant.steps < ready else end)

    def _by_stages(self, end: int) -> None:
        """Make steps in Python up to step `end`."""
        loop, reference, zero = self._loop, self._loop.parts.bar_reference, np.zeros(6)
        plant = loop.simulator.plant
        while plant.steps < end:
            bar_pose, tensions = plant.bar_state[:6].copy(), plant.tensions.copy()
            loop.step()
            error = zero if reference is None else reference[:6] - bar_pose
            torques, tally = loop.simulator.torque, self._statistics.drives
            saturated = count_at_limit(tally, torques, self._limits)
            self._statistics.add(error, tensions, loop.slack, loop.infeasible, saturated)
