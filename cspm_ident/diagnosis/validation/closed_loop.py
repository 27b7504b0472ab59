"""Simulation of a recorded closed loop, with the file's model and with the findings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_ident.signals.measurement import BAR, TENSION, Measurement, read_measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.errors import CspmError
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.recording.run_record import SIM, own_controllers
from cspm_msgs_py.scenario import ClosedLoop
from cspm_msgs_py.testbed import TestbedFile
from cspm_run.bundle import Bundle
from cspm_run.recorded_bundle import recorded_bundle
from cspm_run.recorded_run import run
from cspm_run.run_result import RunResult

Array = NDArray[np.float64]

# Longest simulated part of a recording [s].
LONGEST_S = 30.0


class ClosedLoopFit(NamedTuple):
    """A measured quantity against that of the simulated closed loop.

    Attributes:
        name: topic and column.
        unit: unit of the values.
        measured: standard deviation of the recorded quantity.
        before: RMS difference with the file's model.
        after: RMS difference with the findings.
    """

    name: str
    unit: str
    measured: float
    before: float
    after: float


class Tracking(NamedTuple):
    """How well a simulated bar follows its reference, as root mean squares.

    Attributes:
        position_m: of the distance [m].
        angle_rad: of the rotation [rad].
    """

    position_m: float
    angle_rad: float


class SimulatedLoop(NamedTuple):
    """A recorded closed loop, simulated again.

    Attributes:
        fits: its differences to the recording.
        tracking: with all findings; None where the loop cannot be simulated.
        without: with all but one finding each.
    """

    fits: tuple[ClosedLoopFit, ...] = ()
    tracking: Tracking | None = None
    without: tuple[Tracking | None, ...] = ()


def simulate_closed_loop(
    recorded: Measurement,
    improved: TestbedFile,
    without: Sequence[TestbedFile] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> SimulatedLoop:
    """Return a recording's scenario simulated again under its controllers.

    At most half a minute from the start is simulated. Waves follow the recorded seed, and so does
    the sensors' noise if the recording is of a simulation. Empty where the recording has no closed
    loop that a simulation can run.

    Args:
        recorded: the recording, with the file's model.
        improved: the test-bed with the findings.
        without: the same without one finding each.
        progress: called with a text on each step.
    """
    bundle = _runnable(recorded)
    if bundle is None:
        return SimulatedLoop()
    seconds = min(LONGEST_S, recorded.duration)
    steps = round(seconds * bundle.scenario.rates.plant)
    found = []
    with ScratchFolder("closed-loop") as place:
        for name, machine in (("described", recorded.testbed), ("found", improved)):
            progress(f"closed loop with the machine as {name}")
            folder = place / name
            result = run(replace(bundle, testbed=machine), folder, steps=steps)
            if result.failure:
                return SimulatedLoop()
            found.append(read_measurement(folder))
    tracking = _tracking(result)
    fits = tuple(_fits(recorded.within(0.0, seconds), *found))
    fewer = []
    for machine in without:
        progress("closed loop without each finding")
        fewer.append(_tracking(run(replace(bundle, testbed=machine), None, steps=steps)))
    return SimulatedLoop(fits, tracking, tuple(fewer))


def _runnable(recorded: Measurement) -> Bundle | None:
    """Return the recorded run, to be simulated; None where it has no loop that can be."""
    try:
        bundle = replace(recorded_bundle(recorded.path), plant=SIM)
        with Recording(recorded.path) as recording:
            own = own_controllers(recording)
    except CspmError:
        return None
    closed = isinstance(bundle.scenario.control, ClosedLoop)
    return bundle if own is None and closed and recorded.bar_pose is not None else None


def _tracking(result: RunResult) -> Tracking | None:
    """Return how well a run followed its reference; None where it failed."""
    if result.failure:
        return None
    errors = result.statistics.rms_error
    return Tracking(*(float(np.linalg.norm(part)) for part in (errors[:3], errors[3:])))


def _fits(recorded: Measurement, before: Measurement, after: Measurement) -> list[ClosedLoopFit]:
    cables = recorded.machine.cable_names
    tables = [
        (BAR, DOFS, recorded.bar_pose, before.bar_pose, after.bar_pose),
        (TENSION, cables, recorded.tension, before.tension, after.tension),
    ]
    found = []
    for topic, names, *samples in tables:
        measured, plain, better = samples
        if measured is None or plain is None or better is None:
            continue
        spreads = measured.values.std(axis=0)
        differences = [_rms_difference(measured, each) for each in (plain, better)]
        for i, name in enumerate(names):
            unit = "N" if topic == TENSION else ("m" if i < 3 else "rad")
            numbers = (float(each[i]) for each in (spreads, *differences))
            found.append(ClosedLoopFit(f"{topic[1:]}/{name}", unit, *numbers))
    return found


def _rms_difference(measured: Samples, simulated: Samples) -> Array:
    """Return the RMS difference of each column at the measured stamps."""
    inside = measured.times <= simulated.times[-1]
    at = [np.interp(measured.times[inside], simulated.times, c) for c in simulated.values.T]
    return np.asarray(np.sqrt(np.mean((measured.values[inside] - np.stack(at, axis=1)) ** 2, 0)))
