"""A run whose steps are made in compiled code, block by block.

The staged loop makes the first steps, until every topic has come once. From there on compiled code
makes whole steps on the same objects, and leaves a step to Python where a status is due, a stage is
the user's, or something happens: a fault, a cut, a lost cable.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from cspm_model.phase import LOOK
from cspm_msgs_py.schedule import TORQUE_COMMAND, Schedule
from cspm_run.compiled.job import Job
from cspm_run.compiled.jobs import make_jobs
from cspm_run.compiled.phase_loop import (
    ADDRESS,
    CODE,
    COLUMNS,
    DIVIDER,
    DUE,
    PHASE_INDEX,
    STEP,
    run_phases,
)
from cspm_run.compiled.signal_block import SignalBlock
from cspm_run.loop import Loop
from cspm_run.run_statistics import RunStatistics

Array = NDArray[np.float64]
# Takes log times and stamps [ns], and the rows' bytes.
TakeBlock = Callable[[list[int], list[int], bytes], None]


def first_compiled_step(schedule: Schedule) -> int:
    """Return the step from which on every topic has come once, and everybody has computed."""
    return 1 + max(timing.first for timing in schedule.topics.values())


class CompiledLoop:
    """Goes on with a staged loop's run, in its place.

    Attributes:
        step: the next step.
    """

    def __init__(
        self,
        loop: Loop,
        statistics: RunStatistics,
        take: Mapping[str, TakeBlock],
        block_ns: int,
    ) -> None:
        """Go on where a loop of our own plant is, at `first_compiled_step` or later.

        Args:
            loop: with the run's objects; it is not stepped any more.
            statistics: what is counted in.
            take: where messages go, by topic; topics that are absent are not sent.
            block_ns: at multiples of it messages are handed on [ns].
        """
        self._loop = loop
        self._period_ns, self._block_ns = loop.schedule.period_ns, block_ns
        self._list = make_jobs(loop, statistics, self._row, self._send)
        self._jobs = self._list.jobs
        kept = {topic: job for topic, job in self._list.senders.items() if topic in take}
        steps, count = -(-block_ns // self._period_ns) + 1, len(self._jobs)
        self._block = SignalBlock(self._list.slots, steps, count, kept)
        slots, delays = self._list.slots, self._list.delays
        widths = (slots[topic].stop - slots[topic].start for topic in kept)
        self._takers = [(take[topic], width) for topic, width in zip(kept, widths, strict=True)]
        self._delays_ns = np.array([delays.get(topic, 0) for topic in kept]) * self._period_ns
        self.step = loop.simulator.plant.steps
        self._cursor = np.array([self.step, 0, 0], dtype=np.int64)
        self._timetable = np.zeros((count, COLUMNS), dtype=np.int64)
        for row, job in zip(self._timetable, self._jobs, strict=True):
            row[DUE], row[DIVIDER] = job.due_from(self.step), job.divider
        self._places = np.zeros((count, 0), dtype=np.int64)
        self._last = self._first_row()
        self._bind()
        # Compiles, if need be, before the first step.
        self._run(self.step, self.step)

    def history(self) -> str:
        """Return what preceded the present instant, as `Loop.history`."""
        self._loop.last_feasible = self._list.last_feasible() * self._period_ns * 1e-9
        return self._loop.history()

    def advance(self, end: int) -> None:
        """Make steps up to the next multiple of `block_ns`, at most up to step `end`.

        Raises:
            DivergenceError: as `Loop.step`.
        """
        begin, block_ns = self.step, self._block_ns
        block_end = (begin * self._period_ns // block_ns + 1) * block_ns
        rooms = [job.phase.room for job in self._jobs if job.phase and job.phase.room]
        end = min(end, -(-block_end // self._period_ns), *(room(begin) for room in rooms))
        self._block.start(begin, self._last)
        try:
            self._run(begin, end)
        finally:
            # A step that was not completed has sent what comes before its end all the same.
            self._hand_on(min(end, int(self._cursor[STEP]) + 1) - begin)
        self._last, self.step = self._block.row(end - 1).copy(), end
        self._loop.simulator.plant.steps = end

    def _run(self, begin: int, end: int) -> None:
        cursor, block = self._cursor, self._block
        while True:
            run_phases(cursor, begin, end, self._timetable, self._places, block.rows, block.done)
            if cursor[STEP] == end:
                return
            index = int(cursor[PHASE_INDEX])
            self._loop.simulator.plant.steps = int(cursor[STEP])
            self._by_python(index, self._jobs[index], int(cursor[STEP]))
            self._timetable[index, DUE] += self._timetable[index, DIVIDER]
            cursor[PHASE_INDEX] += 1

    def _by_python(self, index: int, job: Job, step: int) -> None:
        """Let Python do what is due, and compiled code go on from what came of it."""
        if self._cursor[CODE] == LOOK and job.look is not None:
            job.look(step)
            return
        job.python(step)
        if job.rebind is not None and self._timetable[index, ADDRESS] != 0:
            job.phase = job.rebind()
            self._bind()
        elif job.changes:
            self._refresh()

    def _row(self, step: int) -> Array:
        return self._block.row(step)

    def _send(self, step: int, topic: str, row: Array) -> None:
        self._block.send(step, topic, row)

    def _bind(self) -> None:
        """Take the places of all phases."""
        found: Iterable[Job] = self._jobs
        widest = max(len(job.phase.places) for job in found if job.phase is not None)
        self._places = np.zeros((len(self._jobs), widest), dtype=np.int64)
        for row, job in zip(self._places, found, strict=True):
            if job.phase is not None:
                row[: len(job.phase.places)] = job.phase.places
        self._refresh()

    def _refresh(self) -> None:
        for row, job in zip(self._timetable, self._jobs, strict=True):
            row[ADDRESS] = job.address()
            if job.phase is not None:
                job.phase.refresh()

    def _first_row(self) -> Array:
        """Return the signals (width,) as the staged loop left them."""
        slots = self._list.slots
        row = np.zeros(slots.width)
        for topic, values in self._loop.known.items():
            row[slots[topic]] = values
        row[slots[TORQUE_COMMAND]] = self._loop.simulator.torque
        return row

    def _hand_on(self, steps: int) -> None:
        sent = self._block.sent(steps)
        counts = sent.counts.tolist()
        logs = sent.steps * self._period_ns
        stamps = (logs - np.repeat(self._delays_ns, counts)).tolist()
        logs, content = logs.tolist(), sent.numbers.tobytes()
        first = place = 0
        for (take, width), count in zip(self._takers, counts, strict=True):
            if count:
                end, stop = first + count, place + 8 * width * count
                take(logs[first:end], stamps[first:end], content[place:stop])
                first, place = end, stop
