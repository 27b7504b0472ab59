"""What is to be done in a step of a run, in its order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cspm_control.phases.make import stage_phase
from cspm_control.safety import GuardedStage
from cspm_model.phase import Phase, Places, Slots
from cspm_msgs_py.schedule import CLOCK, TORQUE_COMMAND, NodePlan
from cspm_msgs_py.stepping.stage import Stage
from cspm_run.compiled.job import Job
from cspm_run.compiled.signal_block import RowView
from cspm_run.compiled.statistics_phase import FEASIBLE_AT, statistics_phase
from cspm_run.loop import Loop
from cspm_run.run_statistics import RunStatistics
from cspm_sim.kernels.phases import BAD
from cspm_sim.plant import Plant
from cspm_sim.sensor_phases import SensorPhases
from cspm_sim.simulator import Simulator
from cspm_sim.simulator_phases import SimulatorPhases, simulator_phases, true_signals
from cspm_sim.truth import Quantity

Array = NDArray[np.float64]
# Takes step, topic and row of what Python sends; and returns the signals at a step.
SendAt = Callable[[int, str, Array], None]
RowAt = Callable[[int], Array]


@dataclass
class JobList:
    """The jobs of a step, and where the signals are.

    Attributes:
        jobs: in the order of a step.
        slots: where each signal is in a row.
        senders: which job sends a topic.
        delays: steps from stamp to arrival, by topic that has any.
        counted: the phase of the statistics.
    """

    jobs: list[Job]
    slots: Slots
    senders: dict[str, int]
    delays: dict[str, int]
    counted: Phase

    def last_feasible(self) -> int:
        """Return the last step at which the wrench could be met."""
        return int(self.counted.arrays[0][FEASIBLE_AT])


class _Maker:
    """Makes the jobs of a loop's parts."""

    def __init__(self, loop: Loop, row_at: RowAt, send: SendAt) -> None:
        self.loop, self._row_at, self._send = loop, row_at, send
        topics = loop.parts.testbed.topics
        widths = {name: topics[name].width for name in loop.schedule.topics}
        widths.setdefault(TORQUE_COMMAND, len(loop.simulator.torque))
        self.slots = Slots()
        self.slots.add(widths | true_signals(loop.simulator))
        self._integers: Places = np.zeros(0, dtype=np.int64)
        self._read = tuple(n for n in widths if n != CLOCK and not n.startswith("/truth/"))

    def now_ns(self, step: int) -> int:
        return step * self.loop.schedule.period_ns

    def machine(self, found: SimulatorPhases) -> tuple[list[Job], Job]:
        """Return what is observed, and the plant's step."""
        simulator, divider = self.loop.simulator, self.loop.schedule.plant_status_divider
        true = ["/truth" + quantity.topic for quantity in simulator.truth.quantities]
        jobs = [Job(_refuse, topics=(CLOCK, *true), phase=found.truth)]
        for topic, sensor in found.sensors.items():
            if isinstance(sensor, SensorPhases):
                arrival = Job(_refuse, sensor.delay, sensor.divider, (topic,), sensor.arrival)
                jobs += [Job(_refuse, 0, sensor.divider, (), sensor.sample), arrival]
            else:
                jobs.append(Job(self._observed(topic, sensor), topics=(topic,)))
        jobs.append(Job(self._status(simulator), 0, divider))
        self._integers = found.advance.arrays[0]
        advance = Job(self._advance, phase=found.advance, look=self._look, changes=True)
        return jobs, advance

    def stage(self, stage: Stage, plan: NodePlan) -> list[Job]:
        """Return a stage's step, and its status."""
        period_ns = self.loop.schedule.period_ns

        def bind() -> Phase | None:
            return stage_phase(stage, self.slots, period_ns)

        guarded = isinstance(stage, GuardedStage)
        found = Job(self._step(stage), plan.first, plan.divider, plan.outputs, bind(), bind)
        found.changes = guarded
        first = -(-plan.first // plan.status_divider) * plan.status_divider
        return [found, Job(self._status(stage), first, plan.status_divider)]

    def _step(self, stage: Stage) -> Callable[[int], None]:
        def python(step: int) -> None:
            view = RowView(self._row_at(step), self.slots, self._read)
            stage.step(self.now_ns(step), view, lambda topic, row: self._send(step, topic, row))
            self.loop.set_brakes()

        return python

    def _status(self, stage: Stage | Simulator) -> Callable[[int], None]:
        return lambda step: self.loop.publish_status(self.now_ns(step), stage.status())

    def _observed(self, topic: str, quantity: Quantity) -> Callable[[int], None]:
        sensor = self.loop.simulator.sensors[topic]

        def python(step: int) -> None:
            arrival = sensor.observe(step, self.now_ns(step), quantity.values)
            if arrival is not None:
                self._send(step, topic, arrival[1])

        return python

    def _advance(self, step: int) -> None:
        simulator = self.loop.simulator
        simulator.torque = self._row_at(step)[self.slots[TORQUE_COMMAND]].copy()
        simulator.advance()

    def _look(self, step: int) -> None:
        plant = self.loop.simulator.plant
        assert isinstance(plant, Plant)
        plant.finish_step(int(self._integers[BAD]))
        self.loop.simulator.check_upright()


def _refuse(step: int) -> None:
    raise AssertionError(f"step {step}: a phase that is always compiled was left to Python")


def make_jobs(loop: Loop, statistics: RunStatistics, row_at: RowAt, send: SendAt) -> JobList:
    """Return what is to be done in each of a loop's steps.

    Args:
        loop: with the run's objects; its plant is our own.
        statistics: what is counted in.
        row_at: returns the signals at a step.
        send: takes what Python sends at a step.
    """
    maker = _Maker(loop, row_at, send)
    slots, schedule = maker.slots, loop.schedule
    found = simulator_phases(loop.simulator, slots, TORQUE_COMMAND)
    jobs, advance = maker.machine(found)
    for stage in loop.parts.stages:
        jobs += maker.stage(stage, schedule.nodes[stage.node])
    reference = loop.parts.bar_reference
    counted = statistics_phase(statistics, loop.simulator, slots, reference, loop.distribution)
    jobs += [advance, Job(_refuse, phase=counted)]
    senders = {topic: i for i, job in enumerate(jobs) for topic in job.topics}
    delays = {name: timing.delay for name, timing in schedule.topics.items() if timing.delay}
    return JobList(jobs, slots, senders, delays, counted)
