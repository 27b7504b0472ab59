"""One loop of the control as a designer looks at it: margins, Bode lines, step response."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.sampled_system import SampledSystem, closed, series
from cspm_control.design.margins import Margins, Response, margins

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LOWEST_FREQUENCY = 0.05  # rad/s
POINTS = 200
# A response has settled once it stays this close to where it goes.
SETTLED = 0.02


class LoopView(NamedTuple):
    """One loop.

    Attributes:
        margins: of the open loop.
        frequencies: (m,) [rad/s].
        plant: without its controller, (m,).
        open_loop: with it, (m,).
        time: (k,) [s]; empty where no step was taken.
        step: what is controlled after a step of 1 in what is wanted, (k,).
    """

    margins: Margins
    frequencies: Array
    plant: ComplexArray
    open_loop: ComplexArray
    time: Array
    step: Array

    @property
    def settling_time(self) -> float:
        """When the step response is within 2 % of 1 for good [s]; NaN: not in the time shown."""
        off = np.flatnonzero(np.abs(self.step - 1.0) > SETTLED)
        if len(off) == 0 or off[-1] + 1 == len(self.step):
            return float("nan")
        return float(self.time[off[-1] + 1])


def continuous_view(plant: Response, loop: Response, frequencies: Array) -> LoopView:
    """Return the view of a continuous loop, without step."""
    found = margins(loop, frequencies)
    nothing = np.zeros(0)
    return LoopView(found, frequencies, plant(frequencies), loop(frequencies), nothing, nothing)


def sampled_view(
    plant: SampledSystem,
    controller: SampledSystem,
    duration: float,
    whole: SampledSystem | None = None,
) -> LoopView:
    """Return the view of a sampled loop of one input and one output.

    Args:
        plant: as the controller sees it.
        controller: on the same samples.
        duration: of the step response [s].
        whole: from wanted to found, where more is closed than this loop; None: this loop alone.
    """
    loop = series(controller, plant)

    def response(frequencies: Array) -> ComplexArray:
        # Cheaper than the response of both in one.
        parts = plant.response(frequencies) * controller.response(frequencies)
        return np.asarray(parts[:, 0, 0])

    grid = sampled_frequencies(loop)
    follow = closed(plant, controller) if whole is None else whole
    time = plant.period * np.arange(round(duration / plant.period), dtype=np.float64)
    return LoopView(
        _with_highest(margins(response, grid), loop),
        grid,
        plant.response(grid)[:, 0, 0],
        response(grid),
        time,
        follow.steps(np.ones((len(time), 1)))[:, 0],
    )


def _with_highest(found: Margins, loop: SampledSystem) -> Margins:
    """Return margins that count the −180° of half the sampling rate, where samples alternate."""
    at = float(loop.response(np.pi / loop.period)[0, 0, 0].real)
    if not -1.0 < at < 0.0 or found.phase_margin < 0.0:
        return found
    return found._replace(gain_margin=min(found.gain_margin, -20.0 * float(np.log10(-at))))


def sampled_frequencies(loop: SampledSystem) -> Array:
    """Return frequencies up to half the sampling rate, and every resonance, which may be sharp."""
    highest = np.pi / loop.period
    even = np.geomspace(LOWEST_FREQUENCY, 0.9999 * highest, POINTS)
    resonances = np.abs(np.angle(np.linalg.eigvals(loop.A))) / loop.period
    return np.union1d(even, resonances[(resonances > even[0]) & (resonances < even[-1])])
