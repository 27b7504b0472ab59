"""How often 95 % intervals contain the truth, by simulation.

Two experiments with noise that no autoregression of finite order describes (a slow first-order
process with white noise on top): a winch's friction by linear regression, and a mass on a spring
that is simulated and fitted. Each is estimated as `cspm_ident.estimation` does it by default, with
the other kinds of interval, and by plain least squares that takes the residual for white. A third,
`--system`, is a whole machine that another plant recorded, a fourth, `--rig`, cables on a rig that
this project's plant did not make.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, as_completed
from functools import partial
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from scipy.optimize import least_squares
from scipy.signal import lfilter
from scipy.stats import beta

from bench.accuracy.rig_coverage import RigDamping, RigStiffness
from cspm.campaign.cluster import worker_pool
from cspm_ident.estimation import Interval, Parameter, Problem, Record, fit, fit_linear

PLAIN = "plain least squares"
DEFAULT = "whitened likelihood"
COLOUR_TIME = 0.1  # s, of the slow part of the noise


class Experiment(Protocol):
    """Something that can be repeated with other noise and estimated."""

    names: tuple[str, ...]
    truth: np.ndarray

    def intervals(self, rng: np.random.Generator) -> Iterator[tuple[str, np.ndarray]]:
        """Estimate one experiment in every way; intervals of shape (parameters, 2)."""


class Count(NamedTuple):
    """Of `runs` intervals for a parameter, `inside` contained the truth."""

    method: str
    parameter: str
    inside: int
    runs: int

    @property
    def share(self) -> float:
        """The coverage."""
        return self.inside / self.runs

    @property
    def bounds(self) -> tuple[float, float]:
        """Exact 95 % interval of the coverage (Clopper and Pearson 1934)."""
        lower = beta.ppf(0.025, self.inside, self.runs - self.inside + 1) if self.inside else 0.0
        missed = self.runs - self.inside
        return float(lower), float(beta.ppf(0.975, self.inside + 1, missed) if missed else 1.0)


def coloured(rng: np.random.Generator, count: int, period: float) -> np.ndarray:
    """Noise of unit variance: nine tenths slow, one tenth white; shape (count,)."""
    decay = np.exp(-period / COLOUR_TIME)
    draws = rng.standard_normal(count) * np.sqrt(1.0 - decay**2)
    draws[0] = rng.standard_normal()
    slow = lfilter([1.0], [1.0, -decay], draws)
    return np.sqrt(0.9) * slow + np.sqrt(0.1) * rng.standard_normal(count)


class Winch:
    """Torque of a winch with friction, at speeds that are known; two records at 200 Hz."""

    period = 0.005
    names = ("inertia", "viscous", "coulomb", "offset")
    truth = np.array([2.4e-3, 4.0e-3, 0.05, -0.01])
    noise = 0.02  # N·m
    parameters = tuple(
        Parameter(name, "1", scale=1.0) for name in ("inertia", "viscous", "coulomb", "offset")
    )

    def __init__(self, seconds: float = 15.0) -> None:
        """Set the length of each record."""
        self.seconds = seconds

    def records(self, rng: np.random.Generator) -> list[Record]:
        """Simulate one experiment."""
        found = []
        time = np.arange(round(self.seconds / self.period)) * self.period
        for base in (0.31, 0.47):
            frequencies = 2.0 * np.pi * base * np.array([1.0, 2.3, 5.1])
            phases = rng.uniform(0.0, 2.0 * np.pi, 3)
            angles = np.outer(time, frequencies) + phases
            speed = np.sin(angles) @ np.array([8.0, 4.0, 2.0])
            acceleration = np.cos(angles) @ (frequencies * np.array([8.0, 4.0, 2.0]))
            columns = [acceleration, speed, np.sign(speed), np.ones_like(speed)]
            regressors = np.stack(columns, axis=1)
            torque = regressors @ self.truth
            torque += self.noise * coloured(rng, len(time), self.period)
            found.append(Record(torque, regressors))
        return found

    def intervals(self, rng: np.random.Generator) -> Iterator[tuple[str, np.ndarray]]:
        """Estimate one experiment in every way; intervals of shape (parameters, 2)."""
        records = self.records(rng)
        yield PLAIN, self._plain(records)
        yield DEFAULT, fit_linear(records, self.parameters).estimate.ci95
        for name, whiten, interval in (
            ("whitened, sandwich", True, Interval.SANDWICH),
            ("whitened, block bootstrap", True, Interval.BOOTSTRAP),
            ("not whitened, sandwich", False, Interval.SANDWICH),
            ("not whitened, block bootstrap", False, Interval.BOOTSTRAP),
        ):
            found = fit_linear(records, self.parameters, whiten=whiten, interval=interval)
            yield name, found.estimate.ci95

    def _plain(self, records: list[Record]) -> np.ndarray:
        regressors = np.concatenate([record.regressors[:, 0] for record in records])
        target = np.concatenate([record.target[:, 0] for record in records])
        values = np.linalg.lstsq(regressors, target, rcond=None)[0]
        return _white_interval(values, target - regressors @ values, regressors)


class Spring:
    """Position of a mass on spring and damper under known force; two records of 10 s at 100 Hz."""

    period = 0.01
    names = ("mass", "damping", "stiffness")
    truth = np.array([2.0, 3.0, 180.0])
    noise = 0.004  # m
    parameters = (
        Parameter("mass", "kg", 0.5, 8.0, 1.0),
        Parameter("damping", "N·s/m", 0.1, 30.0, 3.0),
        Parameter("stiffness", "N/m", 20.0, 900.0, 100.0),
    )
    start = (3.0, 5.0, 240.0)

    def forces(self, rng: np.random.Generator) -> list[np.ndarray]:
        """Return steps of random height that last 0.3 s [N]."""
        return [np.repeat(rng.normal(0.0, 10.0, 34), 30)[:1000] for _ in range(2)]

    def position(self, theta: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return the position [m], exactly for a force that is held over each sample."""
        mass, damping, stiffness = theta
        poles = np.roots([mass, damping, stiffness]).astype(complex)
        parts = 1.0 / (mass * poles * (poles - poles[::-1]))
        # Displacement one and two samples after a force of 1 N sets in.
        grown = np.exp(np.outer([1.0, 2.0], poles * self.period))
        first, second = 1.0 / stiffness + (grown @ parts).real
        a1, a2 = -grown[0].sum().real, grown[0].prod().real
        numerator = [0.0, first, second - first + a1 * first]
        return lfilter(numerator, [1.0, a1, a2], force)

    def residual(
        self, forces: list[np.ndarray], measured: list[np.ndarray]
    ) -> Callable[[np.ndarray], list[np.ndarray]]:
        """Return the output error as a function of the parameters."""

        def function(theta: np.ndarray) -> list[np.ndarray]:
            pairs = zip(forces, measured, strict=True)
            return [position - self.position(theta, force) for force, position in pairs]

        return function

    def intervals(self, rng: np.random.Generator) -> Iterator[tuple[str, np.ndarray]]:
        """Estimate one experiment in every way; intervals of shape (parameters, 2)."""
        forces = self.forces(rng)
        measured = [
            self.position(self.truth, force) + self.noise * coloured(rng, len(force), self.period)
            for force in forces
        ]
        problem = Problem(self.residual(forces, measured), self.parameters)
        yield PLAIN, self._plain(problem)
        yield DEFAULT, fit(problem, self.start).estimate.ci95
        for name, whiten, interval in (
            ("whitened, sandwich", True, Interval.SANDWICH),
            ("whitened, block bootstrap", True, Interval.BOOTSTRAP),
            ("not whitened, sandwich", False, Interval.SANDWICH),
        ):
            found = fit(problem, self.start, whiten=whiten, interval=interval)
            yield name, found.estimate.ci95

    def _plain(self, problem: Problem) -> np.ndarray:
        found = least_squares(
            lambda theta: np.concatenate(list(problem.residual(theta))),
            self.start,
            x_scale=self.truth,
        )
        return _white_interval(found.x, found.fun, found.jac)


def _white_interval(values: np.ndarray, residual: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
    variance = residual @ residual / (len(residual) - len(values))
    sd = np.sqrt(variance * np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    return np.stack([values - 1.96 * sd, values + 1.96 * sd], axis=1)


def measure_coverage(
    experiment: Experiment,
    runs: int,
    seed: int,
    advance: Callable[[], None] = lambda: None,
    kept: Path | None = None,
    pool: Executor | None = None,
) -> list[Count]:
    """Simulate and estimate `runs` times; run k uses the random numbers of (seed, k).

    Args:
        experiment: what is repeated.
        runs: how often.
        seed: of all runs.
        advance: called after each run.
        kept: a file to which each run's intervals are added as a line of JSON, and from which those
            of runs already made are taken.
        pool: makes the runs; None: this process, one after another.
    """
    study = (type(experiment).__name__, seed)
    known = _kept_runs(kept, *study)
    for _ in known.keys() & range(runs):
        advance()
    missing = [run for run in range(runs) if run not in known]
    for run, drawn in _runs(experiment, seed, missing, pool):
        known[run] = drawn
        _keep(kept, *study, run, drawn)
        advance()
    inside: dict[str, np.ndarray] = {}
    for run in range(runs):
        for method, ends in known[run].items():
            held = (ends[:, 0] <= experiment.truth) & (experiment.truth <= ends[:, 1])
            inside[method] = inside.get(method, 0) + held.astype(int)
    return [
        Count(method, name, int(found), runs)
        for method, counts in inside.items()
        for name, found in zip(experiment.names, counts, strict=True)
    ]


def _runs(
    experiment: Experiment, seed: int, missing: Sequence[int], pool: Executor | None
) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """Yield runs and their intervals, as they are made."""
    if pool is None:
        yield from ((run, _run(experiment, seed, run)) for run in missing)
        return
    begun = {pool.submit(_run, experiment, seed, run): run for run in missing}
    for each in as_completed(begun):
        yield begun[each], each.result()


def _run(experiment: Experiment, seed: int, run: int) -> dict[str, np.ndarray]:
    return dict(experiment.intervals(np.random.default_rng([seed, run])))


def _kept_runs(kept: Path | None, experiment: str, seed: int) -> dict[int, dict[str, np.ndarray]]:
    """Return the intervals of an experiment's runs in a file, by run and method."""
    if kept is None or not kept.exists():
        return {}
    rows = [json.loads(line) for line in kept.read_text(encoding="utf-8").splitlines()]
    return {
        row["run"]: {method: np.array(ends) for method, ends in row["intervals"].items()}
        for row in rows
        if (row["experiment"], row["seed"]) == (experiment, seed)
    }


def _keep(
    kept: Path | None, experiment: str, seed: int, run: int, intervals: dict[str, np.ndarray]
) -> None:
    if kept is not None:
        ends = {method: found.tolist() for method, found in intervals.items()}
        line = json.dumps({"experiment": experiment, "seed": seed, "run": run, "intervals": ends})
        with kept.open("a", encoding="utf-8") as file:
            file.write(f"{line}\n")


def main() -> None:
    """Run the command line."""
    arguments = _arguments()
    console = Console()
    experiments: tuple[Experiment, ...] = (Winch(arguments.seconds), Spring())
    if arguments.system:
        # It needs MuJoCo.
        from bench.accuracy.system_coverage import System

        experiments = (System(),)
    elif arguments.rig:
        experiments = (RigStiffness(), RigDamping())
    with worker_pool(arguments.workers) as pool, Progress(console=console, transient=True) as bar:
        for experiment in experiments:
            task = bar.add_task(type(experiment).__name__, total=arguments.runs)
            counts = measure_coverage(
                experiment,
                arguments.runs,
                arguments.seed,
                advance=partial(bar.advance, task),
                kept=arguments.keep,
                pool=pool,
            )
            console.print(table_of(experiment.__class__.__doc__, counts))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m bench.accuracy.coverage", description=__doc__)
    parser.add_argument("--runs", type=int, default=200, metavar="N", help="per experiment")
    parser.add_argument(
        "--seconds", type=float, default=15.0, metavar="S", help="length of a winch's records"
    )
    parser.add_argument(
        "--system", action="store_true", help="`cspm identify system` instead: 8 s a run"
    )
    parser.add_argument(
        "--rig", action="store_true", help="`cspm identify stiffness` and `damping`: 4 s a run"
    )
    parser.add_argument("--seed", type=int, default=20261121)
    parser.add_argument(
        "--keep",
        type=Path,
        metavar="FILE",
        help="add each run's intervals to it, and leave out the runs that it has",
    )
    parser.add_argument(
        "--workers", type=int, metavar="N", help="processes (default: one per processor)"
    )
    return parser.parse_args()


def table_of(title: str | None, counts: Sequence[Count]) -> Table:
    """Return a table with a row for each count."""
    table = Table("intervals", "parameter", "hold", "share", "its 95 % interval", title=title)
    for before, count in zip([None, *counts], counts, strict=False):
        method = "" if before and before.method == count.method else count.method
        low, high = count.bounds
        held = f"{count.inside} of {count.runs}"
        table.add_row(
            method, count.parameter, held, f"{count.share:.1%}", f"{low:.1%} to {high:.1%}"
        )
    return table


if __name__ == "__main__":
    main()
