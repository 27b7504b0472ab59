"""Channels that are constant, stuck, slack or saturated."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cspm_checks.drive_limit import LIMIT
from cspm_ident.data_look.data_check import DataCheck, check_of
from cspm_ident.signals.jumps import jumps
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_run.run_statistics import torque_limits
from cspm_run.stability.saturation import DriveSaturation, saturation_of, saturation_words

# A reading that is held so long while its winch moves, to the last digit, is no reading.
_HELD_S, _HELD_SAMPLES = 0.2, 20
# Of the shaft's RMS speed: faster than that a shaft does not stand.
_MOVING = 0.2
# Of the time: what lasts shorter moves no estimate by more.
_SHARE = 0.01
_PARTS = ("angle", "torque", "tension", "speed")


def constant_check(measurement: Measurement) -> DataCheck:
    """Return which channels never change, or hold one value while their winch moves."""
    found = []
    for part, name, column in _columns(measurement):
        if len(column.times) > 1 and not np.ptp(column.values):
            found.append(f"{part} of {name} is constant at {column.values[0, 0]:.4g}")
        elif part == "tension" and (held := _held(column, measurement, name)) > _SHARE:
            found.append(f"{part} of {name} is stuck for {100.0 * held:.0f} % of the time")
    remedy = "a constant that was typed in is no reading: say `load` in the test-bed file, or leave"
    remedy += " the channel out; a stuck one: leave the stretch out"
    return check_of("constant", measurement.path, found, "no channel is constant or stuck", remedy)


def jump_check(measurement: Measurement) -> DataCheck:
    """Return at which instants encoders jump."""
    found = []
    for part, name, column in _columns(measurement):
        if part == "angle" and len(at := jumps(column)):
            instants = ", ".join(f"{time:.3f}" for time in column.times[at[:5]])
            more = ", …" if len(at) > 5 else ""
            found.append(f"angle of {name} jumps {len(at)} times, at {instants}{more} s")
    remedy = "a counter that rolls over: `wrap` in the mapping; a spike or reset: leave it out"
    return check_of("jumps", measurement.path, found, "no encoder jumps", remedy)


def slack_check(measurement: Measurement) -> DataCheck:
    """Return which cables are slack, and how long."""
    found = []
    for part, name, column in _columns(measurement):
        cable = next(each for each in measurement.machine.cables if each.name == name)
        if part != "tension" or cable.stiffness is None:
            continue
        share = float(np.mean(column.values[:, 0] <= cable.stiffness.floor_tension))
        if share > _SHARE:
            found.append(f"{name} is slack for {100.0 * share:.1f} % of the time")
    remedy = "raise the lowest tension; slack rows say nothing of the cable"
    return check_of("slack", measurement.path, found, "no cable is slack", remedy)


def drives_at_limit(measurement: Measurement) -> list[DriveSaturation]:
    """Return how each drive met its torque limit; empty without torques."""
    torque, machine = measurement.torque, measurement.machine
    if torque is None:
        return []
    limits = LIMIT * torque_limits(machine)
    return saturation_of(torque.times, torque.values, limits, machine.cable_names)


def saturation_check(measurement: Measurement) -> DataCheck:
    """Return which drives are at their torque limit, and how much of the time.

    A drive that chatters at it follows on average, which is said and is well.
    """
    drives = drives_at_limit(measurement)
    lasting = saturation_words((each for each in drives if each.lasts), _SHARE)
    touching = saturation_words((each for each in drives if not each.lasts), _SHARE)
    found = [f"at their torque limit: {lasting}"] if lasting else []
    well = (
        f"drives touch their torque limit: {touching}" if touching else "no drive is at its limit"
    )
    remedy = (
        "ask for less, or correct `torque_limit`; a saturated drive reports what it cannot give"
    )
    return check_of("saturation", measurement.path, found, well, remedy)


def _columns(measurement: Measurement) -> Iterator[tuple[str, str, Samples]]:
    """Yield part, winch and samples of every channel that may change."""
    for part in _PARTS:
        samples: Samples | None = getattr(measurement, part)
        if samples is not None:
            for i, cable in enumerate(measurement.machine.cables):
                if not (cable.locked and part in ("angle", "speed")):
                    yield part, cable.name, samples.column(i)


def _held(column: Samples, measurement: Measurement, name: str) -> float:
    """Return the share of time in which a value is held to the last digit while the shaft moves."""
    if measurement.angle is None:
        return 0.0
    angle = measurement.angle.column(measurement.machine.cable_names.index(name))
    changes = np.flatnonzero(np.diff(column.values[:, 0])) + 1
    edges = np.concatenate([[0], changes, [len(column.times) - 1]])
    apart = np.diff(column.times[edges])
    long = (apart > _HELD_S) & (np.diff(edges) >= _HELD_SAMPLES)
    if not long.any():
        return 0.0
    rate = np.sqrt(np.mean((np.diff(angle.values[:, 0]) / np.diff(angle.times)) ** 2))
    travel = np.abs(np.diff(np.interp(column.times[edges], angle.times, angle.values[:, 0])))
    stuck = long & (travel > _MOVING * rate * apart)
    return float(apart[stuck].sum() / max(measurement.duration, 1e-9))
