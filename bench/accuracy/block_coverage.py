"""How often 95 % intervals of a diagnosis hold the truth when its blocks are correlated.

`python -m bench.accuracy.block_coverage` draws first-order autoregressive noise over blocks, takes
the intervals of one weight and writes the table of results/intervals.md.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from bench.page import into_page
from cspm_ident.diagnosis.regression.long_run import long_run

Array = NDArray[np.float64]
Regressor = Callable[[np.random.Generator, int], Array]

PAGE = Path(__file__).resolve().parents[2] / "results" / "intervals.md"
CORRELATIONS, BLOCKS = (0.0, 0.3, 0.5, 0.7, 0.9), (12, 24, 48)
RUNS, SEED = 10000, 18
NORMAL = 1.96


class Share(NamedTuple):
    """What intervals of one weight did.

    Attributes:
        holds: share of finite intervals that hold the truth.
        width: mean finite half width over 1.96 standard deviations of the weight.
        few: share of runs with too few independent stretches.
    """

    holds: float
    width: float
    few: float


def _informative(count: Callable[[int], int], scattered: bool) -> Regressor:
    """Return a regressor of size 1 in some blocks and 0 in all others."""

    def drawn(rng: np.random.Generator, blocks: int) -> Array:
        many, found = count(blocks), np.zeros(blocks)
        first = int(rng.integers(blocks - many + 1))
        near = np.arange(first, first + many)
        found[rng.choice(blocks, many, replace=False) if scattered else near] = 1.0
        return found

    return drawn


REGRESSORS: dict[str, Regressor] = {
    "constant": lambda _, blocks: np.ones(blocks),
    "random sign and size": lambda rng, blocks: rng.standard_normal(blocks),
    "dies away over an eighth": lambda _, blocks: np.exp(-8.0 * np.arange(blocks) / blocks),
    "a third, in a row": _informative(lambda blocks: blocks // 3, scattered=False),
    "four, scattered": _informative(lambda _: 4, scattered=True),
    "two, scattered": _informative(lambda _: 2, scattered=True),
}


def noise(rng: np.random.Generator, blocks: int, correlation: float) -> Array:
    """Return stationary first-order noise of unit variance, (blocks,)."""
    values = rng.standard_normal(blocks)
    values[1:] *= np.sqrt(1.0 - correlation**2)
    return np.asarray(lfilter([1.0], [1.0, -correlation], values))


def parts_of(regressor: Array, target: Array) -> Array:
    """Return each block's Gram matrix, of one row, (blocks, 2, 2)."""
    rows = np.stack([regressor, target], axis=1)
    return rows[:, :, None] * rows[:, None, :]


def coverage(regressor: Regressor, blocks: int, correlation: float, runs: int, seed: int) -> Share:
    """Return how often intervals of a weight that is 0 hold it, over other draws of all."""
    rng = np.random.default_rng((seed, blocks, round(100 * correlation)))
    weights, halves, few = np.zeros(runs), np.zeros(runs), np.zeros(runs, dtype=bool)
    for k in range(runs):
        column = regressor(rng, blocks)
        parts = parts_of(column, noise(rng, blocks, correlation))
        found = long_run(parts, 1)
        weights[k] = parts[:, 0, 1].sum() / parts[:, 0, 0].sum()
        halves[k], few[k] = found.half_widths[0], found.few_stretches[0]
    finite = np.isfinite(halves)
    holds = np.mean(np.abs(weights[finite]) <= halves[finite])
    scatter = np.sqrt(np.mean(weights[finite] ** 2))
    width = halves[finite].mean() / (NORMAL * scatter)
    return Share(float(holds), float(width), float(few.mean()))


def table() -> str:
    """Return coverage, mean half width and the share with too few stretches as Markdown."""
    head = ["regressor", "blocks", *(f"ρ = {each:g}" for each in CORRELATIONS)]
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for name, regressor in REGRESSORS.items():
        for blocks in BLOCKS:
            shares = [coverage(regressor, blocks, each, RUNS, SEED) for each in CORRELATIONS]
            cells = [f"{100 * s.holds:.1f} / {s.width:.2f} / {100 * s.few:.0f}" for s in shares]
            lines.append(f"| {' | '.join([name, str(blocks), *cells])} |")
    return "\n".join(lines)


if __name__ == "__main__":
    into_page(PAGE, "block coverage", table())
