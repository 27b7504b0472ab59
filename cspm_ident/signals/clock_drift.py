"""How fast the clock of motion capture runs away from that of drives and load cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.estimation import Parameter, Record, fit_linear
from cspm_ident.signals.delays import (
    EQUATION_S,
    LONGEST_S,
    LONGEST_STEP_S,
    NORMAL_95,
    PERIOD_NS,
    RESOLUTION_S,
    ROUNDS,
    SCALE_S,
    SHORTEST_S,
    STILL_S,
    WIDEST_HZ,
    delay_records,
    least_squares,
    moves,
    winds,
)
from cspm_ident.signals.measurement import BAR, FRAME, TENSION, Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.timeline import Timeline
from cspm_model.kernels.machine import PlantParameters
from cspm_msgs_py.testbed import Testbed
from cspm_sim.parameters import plant_parameters

Array = NDArray[np.float64]

_ATTRIBUTES = {BAR: "bar_pose", FRAME: "frame_pose", TENSION: "tension"}


@dataclass(frozen=True)
class ClockDrift:
    """How a sensor's delay grows while a recording lasts.

    Attributes:
        topic: the sensor.
        rate: by how much later its stamps become per second.
        interval: of 95 %.
        apart: time between the middles of the recording's halves, or of the stretches at its
            beginning and end that were looked at [s].
    """

    topic: str
    rate: float
    interval: tuple[float, float]
    apart: float

    @property
    def matters(self) -> bool:
        """Whether it is significant, and more than smoothing and noise can cause."""
        low, high = self.interval
        # The delay of either part has its own resolution.
        return not low <= 0.0 <= high and abs(self.rate) * self.apart > sqrt(2.0) * RESOLUTION_S

    @property
    def text(self) -> str:
        """What was found, in a few words."""
        low, high = (1e6 * end for end in self.interval)
        return f"clock drifts by {1e6 * self.rate:.1f} ppm (95 %: {low:.1f} to {high:.1f} ppm)"

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return {"topic": self.topic, "rate": self.rate, "ci95": list(self.interval)}


def find_drifts(timeline: Timeline, testbed: Testbed) -> list[ClockDrift]:
    """Return how much each sensor of motion capture drifts, from beginning and end together.

    Of each at most a minute is looked at. Where winches stand still a delay is no different from
    another damping, whose share changes with the motion: nothing is returned, as where too little
    moves or is measured.

    Args:
        timeline: the recording's signals, no delay taken out.
        testbed: the machine.
    """
    if timeline.bars is None or timeline.tensions is None:
        return []
    parameters = plant_parameters(testbed)
    if not winds(timeline, parameters):
        return []
    steps = len(timeline.times) - 1
    half = min(steps // 2, round(LONGEST_S / timeline.period))
    if half * timeline.period < 2.0 * SHORTEST_S:
        return []
    parts = [(0, half), (steps - half, steps)]
    band = min(timeline.pose_band, WIDEST_HZ)
    pieces = [timeline.within(*part).slowly(PERIOD_NS, band) for part in parts]
    names = [n for n in (BAR, FRAME) if all(_moves(piece, n) for piece in pieces)]
    return _search(pieces, parameters, names, (steps - half) * timeline.period) if names else []


def without_drifts(measurement: Measurement, drifts: Sequence[ClockDrift]) -> Measurement:
    """Return the measurement with stamps that drift no more; what is left is the first delay."""
    for drift in drifts:
        name = _ATTRIBUTES[drift.topic]
        samples: Samples = getattr(measurement, name)
        times = samples.times / (1.0 + drift.rate)
        measurement = measurement.with_samples(name, Samples(times, samples.values))
    return measurement


def on_one_clock(timeline: Timeline, testbed: Testbed) -> tuple[Timeline, list[ClockDrift]]:
    """Return the signals without the drifts that matter, and these."""
    drifts = [drift for drift in find_drifts(timeline, testbed) if drift.matters]
    if not drifts:
        return timeline, drifts
    return Timeline(without_drifts(timeline.measurement, drifts), timeline.period_ns), drifts


def _moves(piece: Timeline, topic: str) -> bool:
    sensors = piece.measurement.sensors
    return topic in sensors and moves(sensors[topic])


def _search(
    pieces: Sequence[Timeline], parameters: PlantParameters, names: list[str], apart: float
) -> list[ClockDrift]:
    """Return the drifts by least squares, linearised anew until they stand still."""
    delays, drifts = dict.fromkeys(names, 0.0), dict.fromkeys(names, 0.0)
    count = len(names)
    unit = np.repeat([1.0, 1.0 / apart], count)
    for _ in range(ROUNDS):
        moved = [piece.delayed(delays, drifts) for piece in pieces]
        found = [delay_records(piece, parameters, names, drifting=True) for piece in moved]
        records = [record for each, _ in found for record in each]
        unknowns = found[0][1]
        if not all(each and unknowns == own for each, own in found):
            return []
        steps = least_squares(records)[: 2 * count] / unit
        steps = np.clip(steps, -LONGEST_STEP_S, LONGEST_STEP_S)
        if np.abs(steps).max() < STILL_S:
            break
        for i, name in enumerate(names):
            delays[name] += float(steps[i])
            drifts[name] += float(steps[count + i]) / apart
    return _drifts(records, unknowns, drifts, apart)


def _drifts(
    records: Sequence[Record], unknowns: Sequence[str], drifts: dict[str, float], apart: float
) -> list[ClockDrift]:
    """Return the drifts with intervals: of coloured noise, and of the equation's own error."""
    count = len(drifts)
    scales = [*[SCALE_S] * count, *[SCALE_S / apart] * count]
    scales += [1.0] * (len(unknowns) - 2 * count)
    parameters = [Parameter(n, "1", scale=s) for n, s in zip(unknowns, scales, strict=True)]
    ends = fit_linear(records, parameters, whiten=False).estimate.ci95[count : 2 * count]
    own = NORMAL_95 * sqrt(2.0) * EQUATION_S / apart
    found = []
    for (topic, rate), (low, high) in zip(drifts.items(), ends, strict=True):
        half = hypot(0.5 * (high - low), own)
        found.append(ClockDrift(topic, rate, (rate - half, rate + half), apart))
    return found
