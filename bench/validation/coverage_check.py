"""How often 95 % intervals contain the truth, over 200 runs of each experiment."""

from __future__ import annotations

from collections.abc import Iterable

from scipy.stats import binom

from bench.accuracy.coverage import PLAIN, Count, Experiment, Spring, Winch, measure_coverage
from bench.validation.check import Check, Finding, at_least, at_most

RUNS, SEED = 200, 20261121
# With a true coverage of 90 to 97 %, one experiment in a thousand ends outside.
CHANCE, LEAST_SHARE = 1e-3, 0.90


def judged(counts: Iterable[Count]) -> list[Finding]:
    """Return each count with its bound: plain least squares has to miss, all else to hold."""
    found = []
    for count in counts:
        fewest = int(binom.ppf(CHANCE, count.runs, LEAST_SHARE))
        quantity = f"{count.method}: {count.parameter}"
        if count.method == PLAIN:
            found.append(at_most(quantity, count.inside, fewest - 1, count.runs))
        else:
            found.append(at_least(quantity, count.inside, fewest, count.runs))
    return found


def measure(experiment: Experiment, runs: int = RUNS) -> list[Finding]:
    """Return the intervals of an experiment that contain the truth, with their bounds."""
    return judged(measure_coverage(experiment, runs, SEED))


CHECKS = (
    Check(
        "Intervals of a linear winch model",
        f"{RUNS} runs of two records of 15 s, seed {SEED}: 95 % intervals that contain the truth",
        lambda: measure(Winch()),
    ),
    Check(
        "Intervals of a simulated mass on a spring",
        f"{RUNS} runs of two records of 10 s, seed {SEED}: 95 % intervals that contain the truth",
        lambda: measure(Spring()),
    ),
)
