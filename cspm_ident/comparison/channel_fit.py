"""One measured quantity beside its simulation."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.comparison.metrics import Bin, best_lag, bins_data, coherence_of, nrmse
from cspm_ident.vaf import vaf

Array = NDArray[np.float64]

# Below this many times the floor a signal is noise, and shares of it mean nothing.
_MOVES = 3.0


@dataclass(frozen=True, eq=False)
class ChannelFit:
    """A quantity at its sensor's own samples.

    Attributes:
        name: topic and column, such as `cables/tension/surge_2`.
        unit: of the values.
        block: what was simulated to get it: `whole`, `winch`, `cable` or `bar`.
        times: stamps [s], shape (n,).
        measured, simulated: shape (n,).
        floor: RMS that sensor noise and noise on the inputs leave of the error.
        bins: errors against other quantities.
    """

    name: str
    unit: str
    block: str
    times: Array
    measured: Array
    simulated: Array
    floor: float
    bins: dict[str, list[Bin]] = field(default_factory=dict)

    @cached_property
    def error(self) -> Array:
        """Measured minus simulated."""
        return self.measured - self.simulated

    @cached_property
    def rms(self) -> float:
        """RMS of the error."""
        return float(np.sqrt(np.mean(self.error**2)))

    @cached_property
    def bias(self) -> float:
        """Mean of the error."""
        return float(self.error.mean())

    @cached_property
    def moves(self) -> bool:
        """Whether the measured signal does more than its noise."""
        return bool(np.std(self.measured) > _MOVES * self.floor and np.ptp(self.measured) > 0.0)

    @cached_property
    def vaf(self) -> float | None:
        """Variance accounted for [%]; None where nothing moves."""
        return vaf(self.measured, self.simulated) if self.moves else None

    @cached_property
    def nrmse(self) -> float | None:
        """RMS error over the signal's standard deviation; None where nothing moves."""
        return nrmse(self.measured, self.simulated) if self.moves else None

    @cached_property
    def interval(self) -> float:
        """The usual time between samples [s]."""
        return float(np.median(np.diff(self.times)))

    @cached_property
    def lag(self) -> float | None:
        """By how much the measured signal is later [s]; None where nothing moves."""
        return best_lag(self.measured, self.simulated, self.interval) if self.moves else None

    @cached_property
    def coherence(self) -> tuple[Array, Array]:
        """Frequencies [Hz] and coherence of both."""
        return coherence_of(self.measured, self.simulated, 1.0 / self.interval)

    def data(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        frequencies, values = self.coherence
        return {
            "channel": self.name,
            "block": self.block,
            "unit": self.unit,
            "vaf": self.vaf,
            "nrmse": self.nrmse,
            "rms": self.rms,
            "bias": self.bias,
            "lag_s": self.lag,
            "noise_floor": self.floor,
            "samples": len(self.times),
            "coherence": {"frequency_hz": frequencies.tolist(), "coherence": values.tolist()},
            "bins": bins_data(self.bins),
        }
