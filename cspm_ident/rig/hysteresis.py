"""How far stretching and releasing lie apart."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from cspm_ident.rig.flanks import Flank, Ramps

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hysteresis:
    """The loop of a specimen, at equal wound cable.

    Attributes:
        half_width: half the tension stretching less releasing, mean over cycles and stroke [N].
        interval: 95 % of it, from the scatter of the cycles [N].
        loss: energy lost in a cycle over the energy put in.
        viscous: half width that the test-bed's damper makes at this speed [N].
        alignment: half width that load cell and encoder one sample apart would make [N].
    """

    half_width: float
    interval: tuple[float, float]
    loss: float
    viscous: float
    alignment: float

    @property
    def limit(self) -> float:
        """Half width below which it cannot be distinguished from none [N]."""
        return 0.5 * (self.interval[1] - self.interval[0]) + self.alignment

    @property
    def seen(self) -> bool:
        """Whether more is there than damper, scatter and alignment explain."""
        return self.half_width - self.viscous > self.limit

    def data(self) -> dict[str, Any]:
        """Return everything as plain data for JSON."""
        return asdict(self) | {"limit": self.limit, "seen": self.seen}


def find_hysteresis(ramps: Ramps) -> Hysteresis:
    """Return the size of a specimen's loops, each cycle's flank up against its flank down."""
    pairs = list(zip(ramps.flanks[::2], ramps.flanks[1::2], strict=True))
    loops = np.array([_loop(up, down) for up, down in pairs])
    width, loss = loops.mean(axis=0)
    spread = float(loops[:, 0].std(ddof=1) / np.sqrt(len(loops)))
    half = float(student.ppf(0.975, len(loops) - 1)) * spread
    specimen, speed = ramps.specimen, float(np.mean([flank.speed for flank in ramps.flanks]))
    stiffness = float(np.mean([flank.stiffness.mean() for flank in ramps.flanks]))
    damping = specimen.cable.damping
    constant = damping.constant - damping.slope * specimen.length if damping else 0.0
    return Hysteresis(
        half_width=float(width),
        interval=(float(width - half), float(width + half)),
        loss=float(loss),
        viscous=max(0.0, constant) * (damping.factor if damping else 0.0) * speed,
        alignment=stiffness * speed * specimen.period,
    )


def _loop(up: Flank, down: Flank) -> tuple[float, float]:
    """Return half the mean gap [N] and the share of the energy that is lost."""
    low, high = (
        max(up.wound.min(), down.wound.min()),
        min(up.wound.max(), down.wound.max()),
    )
    grid = np.linspace(low, high, len(up.wound))
    stretching, releasing = (
        np.interp(grid, np.sort(flank.wound), flank.tension[np.argsort(flank.wound)])
        for flank in (up, down)
    )
    gap = stretching - releasing
    return float(0.5 * gap.mean()), float(gap.sum() / stretching.sum())
