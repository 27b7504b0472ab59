"""What a run amounted to, however it was run."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from cspm_msgs_py.stepping.delay_histogram import DelayHistogram
from cspm_run.run_statistics import RunStatistics
from cspm_run.stability.saturation import DriveSaturation


@dataclass(frozen=True)
class RunResult:
    """What a run amounted to.

    Attributes:
        scenario: the scenario's name.
        seed: of waves and sensors.
        mode: how it was run.
        simulated: time simulated [s].
        elapsed: wall time that took [s], without start-up and the first step.
        statistics: errors and tensions.
        messages: how many messages each topic got.
        folder: the recording, if one was made.
        controlled: the DOFs in which a closed loop was to follow the reference, if any.
        has_bar: whether the errors mean anything.
        interrupted: whether the user ended it early.
        failure: what went wrong, in one line, if anything did.
        warnings: what is not as it should be though the run went on, a line each.
        limits_met: a line on how much of the time a closed loop was at a limit, if it matters.
        saturation: how each drive met its torque limit.
        timing: in real time, what each node reported of its deadlines and inputs, by node.
        delays: in real time, how late torque commands came to the simulated plant.
    """

    scenario: str
    seed: int
    mode: str
    simulated: float
    elapsed: float
    statistics: RunStatistics
    messages: dict[str, int]
    folder: Path | None
    controlled: tuple[str, ...]
    has_bar: bool
    interrupted: bool = False
    failure: str | None = None
    warnings: tuple[str, ...] = ()
    limits_met: str | None = None
    saturation: tuple[DriveSaturation, ...] = ()
    timing: dict[str, dict[str, float]] = field(default_factory=dict)
    delays: DelayHistogram | None = None

    @property
    def real_time_factor(self) -> float:
        """Simulated time over elapsed time."""
        return self.simulated / self.elapsed if self.elapsed > 0 else 0.0
