"""How often intervals contain the truth; the whole table is `python -m bench.accuracy.coverage`."""

import numpy as np
import pytest
from rich.console import Console
from scipy.stats import binom

from bench.accuracy.coverage import (
    DEFAULT,
    PLAIN,
    Count,
    Spring,
    Winch,
    coloured,
    measure_coverage,
    table_of,
)
from cspm.campaign.cluster import worker_pool

RUNS = 60
# With a coverage of 90 to 97 % no more than one in a thousand experiments of 60 runs ends outside.
FEWEST = binom.ppf(1e-3, RUNS, 0.90)


class OnlyTwo:
    """An experiment without the kinds of interval that are not compared here."""

    def __init__(self, experiment):
        self.names, self.truth = experiment.names, experiment.truth
        self._experiment = experiment

    def intervals(self, rng):
        for method, ends in self._experiment.intervals(rng):
            yield method, ends
            if method == DEFAULT:
                return


@pytest.mark.slow
@pytest.mark.parametrize("experiment", [Winch(), Spring()], ids=["linear", "simulated"])
def test_intervals_contain_the_truth_and_those_of_plain_least_squares_do_not(experiment):
    counts = measure_coverage(OnlyTwo(experiment), RUNS, seed=7)
    ours = [count for count in counts if count.method == DEFAULT]
    plain = [count for count in counts if count.method == PLAIN]
    assert len(ours) == len(plain) == len(experiment.names)
    for count in ours:
        assert count.inside >= FEWEST, count
    # Not so long that they say nothing either: at 99.5 % all of so many would rarely be inside.
    total = sum(count.inside for count in ours)
    assert total < binom.ppf(1.0 - 1e-3, RUNS * len(ours), 0.985)
    for count in plain:
        assert count.inside < FEWEST, count


def test_noise_of_the_experiments_has_the_colour_it_says():
    """Unit variance, a tenth of it white, the rest with 0.1 s of memory."""
    noise = coloured(np.random.default_rng(1), 400_000, 0.01)
    assert noise.var() == pytest.approx(1.0, abs=0.03)
    lags = [np.mean(noise[k:] * noise[: len(noise) - k]) for k in (1, 10, 20)]
    np.testing.assert_allclose(lags, 0.9 * np.exp([-0.1, -1.0, -2.0]), atol=0.03)


def test_exact_bounds_of_a_count():
    """Half of the ends' probability lies beyond each, by the distribution of the count itself."""
    low, high = Count("", "", 188, 200).bounds
    assert binom.sf(187, 200, low) == pytest.approx(0.025)
    assert binom.cdf(188, 200, high) == pytest.approx(0.025)
    assert Count("", "", 10, 10).bounds[1] == 1.0
    assert Count("", "", 0, 10).bounds[0] == 0.0


class Coin:
    """Intervals of one parameter, counted how often they are asked for."""

    names = ("side",)
    truth = np.array([0.5])
    options = 0

    def intervals(self, rng):
        self.options += 1
        low = rng.uniform(0.0, 1.0)
        yield "coin", np.array([[low, np.inf]])


class Dice(Coin):
    """Another experiment."""


def test_runs_that_were_kept_are_not_made_again(tmp_path):
    """And count as if they had been; another seed's and another experiment's do not."""
    first, second, other = Coin(), Coin(), Coin()
    file = tmp_path / "runs.jsonl"
    measure_coverage(first, 4, seed=1, kept=file)
    found = measure_coverage(second, 10, seed=1, kept=file)
    assert (first.options, second.options) == (4, 6)
    assert found == measure_coverage(Coin(), 10, seed=1)
    assert 0 < found[0].inside < 10
    measure_coverage(other, 2, seed=2, kept=file)
    assert other.options == 2
    third = Dice()
    measure_coverage(third, 3, seed=1, kept=file)
    assert third.options == 3


@pytest.mark.slow
def test_runs_in_other_processes_give_the_same(tmp_path):
    """Each run has random numbers of its own, whoever makes it, in which order ever."""
    file = tmp_path / "runs.jsonl"
    done = []
    measure_coverage(Spring(), 1, seed=3, kept=file)
    with worker_pool(2) as pool:
        found = measure_coverage(
            Spring(), 4, seed=3, advance=lambda: done.append(1), kept=file, pool=pool
        )
    assert len(done) == 4
    assert len(file.read_text(encoding="utf-8").splitlines()) == 4
    assert found == measure_coverage(Spring(), 4, seed=3)


def test_a_table_of_many_parameters_fits_a_narrow_terminal():
    counts = [
        Count(method, f"E at {length} m", 181, 200)
        for method in (DEFAULT, PLAIN)
        for length in range(9)
    ]
    console = Console(width=80)
    with console.capture() as shown:
        console.print(table_of("Cables on a rig.", counts))
    text = shown.get()
    assert "…" not in text
    assert text.count(DEFAULT) == text.count(PLAIN) == 1
    rows = [line for line in text.splitlines() if "E at" in line]
    assert len(rows) == len(counts)
    assert all("181 of 200" in row and "85.6% to 94.2%" in row for row in rows)
