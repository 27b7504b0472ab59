"""The slow ramps of a trapezoid and the stiffness along them, thesis (3-4)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from cspm_ident.rig.specimen import Specimen
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]

UP, DOWN = "up", "down"
ORDER = 2
# A ramp is what moves faster than this share of the fastest motion, for this many periods of the
# cut-off frequency; it counts where it goes at nearly its own median speed.
MOVING, STEADY = 0.3, 0.95
SHORTEST = 4.0
# Samples kept per period of the cut-off frequency: the filter leaves nothing between them.
SAMPLES = 5.0
ROUNDING = 1e-6
FEWEST_CYCLES = 2


class Flank(NamedTuple):
    """A ramp of one cycle.

    Attributes:
        cycle: counted from 0.
        branch: `up` where the cable is stretched, `down` where it is released.
        wound: cable wound in, (n,) [m].
        tension: (n,) [N].
        stiffness: Δt/Δwound, (n,) [N/m].
        speed: median rate at which cable is wound in [m/s].
    """

    cycle: int
    branch: str
    wound: Array
    tension: Array
    stiffness: Array
    speed: float


@dataclass(frozen=True)
class Ramps:
    """A specimen's ramps.

    Attributes:
        specimen: the cable.
        flanks: in order of time, up and down in turns.
        lowest: cable wound in [m] where all of them have begun, and their mean tension there [N].
    """

    specimen: Specimen
    flanks: tuple[Flank, ...]
    lowest: tuple[float, float]

    @property
    def cycles(self) -> int:
        """How many cycles there are."""
        return len(self.flanks) // 2

    @property
    def lowest_by_cycle(self) -> Array:
        """The tension where all ramps have begun, of each cycle, (cycles,) [N]."""
        each = np.array([_at(self.lowest[0], flank) for flank in self.flanks])
        return np.asarray(each.reshape(-1, 2).mean(axis=1))


def find_ramps(specimen: Specimen, cutoff: float) -> Ramps:
    """Return the ramps of a specimen that was stretched and released slowly, again and again.

    Angle and tension pass a Butterworth filter forwards and backwards, without phase, and the
    stiffness is the quotient of their differences, thesis (3-4).

    Args:
        specimen: the cable.
        cutoff: of the filter [Hz].

    Raises:
        InputError: too few cycles, or samples too far apart for the filter.
    """
    rate = 1.0 / specimen.period
    if rate < 4.0 * cutoff:
        raise InputError(
            f"{specimen.label}: {rate:.3g} Hz, allowed with a cut-off at {cutoff:g} Hz: at least"
            f" {4.0 * cutoff:g} Hz"
        )
    sections = butter(ORDER, cutoff, fs=rate, output="sos")
    wound = sosfiltfilt(sections, specimen.wound)
    tension = sosfiltfilt(sections, specimen.tension)
    speed = np.diff(wound) * rate
    runs = _runs(speed, int(SHORTEST / cutoff * rate))
    step = max(1, int(rate / (SAMPLES * cutoff) + ROUNDING))
    flanks = tuple(
        _flank(i // 2, chosen[::step], wound, tension, speed)
        for i, chosen in enumerate(_pairs(runs, speed))
    )
    if len(flanks) < 2 * FEWEST_CYCLES:
        raise InputError(
            f"{specimen.label}: {len(flanks) // 2} slow cycles of stretching and releasing in"
            f" {specimen.recording}, allowed: at least {FEWEST_CYCLES}"
        )
    place = max(float(flank.wound.min()) for flank in flanks)
    least = float(np.mean([_at(place, flank) for flank in flanks]))
    return Ramps(specimen, flanks, (place, least))


def _at(place: float, flank: Flank) -> float:
    """Return the tension [N] where so much cable is wound in [m]."""
    order = np.argsort(flank.wound)
    return float(np.interp(place, flank.wound[order], flank.tension[order]))


def _runs(speed: Array, shortest: int) -> list[NDArray[np.intp]]:
    """Return the samples of each stretch of time that moves in one direction, in order."""
    direction = np.sign(speed) * (np.abs(speed) > MOVING * np.abs(speed).max())
    edges = np.flatnonzero(np.diff(direction)) + 1
    pieces = np.split(np.arange(len(speed)), edges)
    return [piece for piece in pieces if direction[piece[0]] and len(piece) >= shortest]


def _pairs(runs: list[NDArray[np.intp]], speed: Array) -> list[NDArray[np.intp]]:
    """Return the steady parts of runs up that a run down follows, and of these, in turns."""
    found: list[NDArray[np.intp]] = []
    for up, down in pairwise(runs):
        if speed[up[0]] > 0.0 > speed[down[0]]:
            found += [_steady(up, speed), _steady(down, speed)]
    return found


def _steady(run: NDArray[np.intp], speed: Array) -> NDArray[np.intp]:
    size = np.abs(speed[run])
    return np.asarray(run[size >= STEADY * np.median(size)])


def _flank(
    cycle: int, chosen: NDArray[np.intp], wound: Array, tension: Array, speed: Array
) -> Flank:
    middle = 0.5 * (tension[chosen] + tension[chosen + 1])
    change = wound[chosen + 1] - wound[chosen]
    return Flank(
        cycle=cycle,
        branch=UP if speed[chosen[0]] > 0.0 else DOWN,
        wound=0.5 * (wound[chosen] + wound[chosen + 1]),
        tension=middle,
        stiffness=(tension[chosen + 1] - tension[chosen]) / change,
        speed=float(np.median(np.abs(speed[chosen]))),
    )
