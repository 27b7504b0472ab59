"""What a run of nodes amounted to, from its recording."""

from __future__ import annotations

from pathlib import Path

from cspm_msgs_py.recording.overview import overview
from cspm_run.bundle import Bundle
from cspm_run.controlled_dofs import controlled_dofs
from cspm_run.recorded_statistics import recording_statistics
from cspm_run.recorded_timing import first_alarm, timing_of, torque_delays
from cspm_run.run_result import RunResult
from cspm_run.stability.run_warnings import limits_met, run_warnings


def recorded_result(
    bundle: Bundle,
    folder: Path,
    mode: str,
    *,
    simulated: float,
    elapsed: float,
    interrupted: bool,
    failure: str | None,
    timed: bool = False,
) -> RunResult:
    """Return the result of a run that is recorded in a folder; see `RunResult`.

    `failure` is what is known of it besides alarms in the recording; `timed` says whether nodes
    reported deadlines.

    Raises:
        InputError: the recording cannot be read.
    """
    scenario, testbed = bundle.scenario, bundle.testbed.testbed
    statistics = recording_statistics(folder, testbed)
    return RunResult(
        scenario=scenario.name,
        seed=scenario.seed,
        mode=mode,
        simulated=simulated,
        elapsed=elapsed,
        statistics=statistics,
        messages={topic.name: topic.count for topic in overview(folder).topics},
        folder=folder.absolute(),
        controlled=controlled_dofs(scenario),
        has_bar=testbed.bar is not None,
        interrupted=interrupted and failure is None,
        failure=failure or first_alarm(folder),
        warnings=run_warnings(scenario, testbed, statistics, late=timed),
        limits_met=limits_met(scenario, testbed, statistics),
        saturation=tuple(statistics.saturation(testbed.cable_names)),
        timing=timing_of(folder) if timed else {},
        delays=torque_delays(folder) if timed else None,
    )
