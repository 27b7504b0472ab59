"""Tension distribution methods on one table: `python -m bench.accuracy.tension_distribution`.

Two tests. The feasible set: wrenches A·t of tension sets t drawn within the limits, at poses drawn
over the workspace, so that each has a solution. The worst case: the wrench of the reference at each
millisecond, whose solvable instants a linear programme names.
"""

from __future__ import annotations

import argparse
import time
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from bench.performance.host import describe_machine, is_busy
from bench.results.feasibility import least_tensions
from bench.results.tracking import Case, assembled
from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_control.controllers.bar_dynamics import bar_parameters, wanted_motion, wrench_for
from cspm_model.kernels.rows import pose_row
from cspm_model.kinematics import geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.control_spec.distribution import DistributionMethod
from cspm_msgs_py.control_spec.distribution import TensionDistribution as HowDistributed
from cspm_msgs_py.testbed import Testbed
from cspm_run.bundle import Bundle

Array = NDArray[np.float64]

# All but the one whose tensions somebody prescribes.
METHODS: tuple[DistributionMethod, ...] = tuple(
    method for method in get_args(DistributionMethod) if method != "prescribed"
)
# Poses about where the bar hangs: most of the workspace of table 6-1 and all heights.
CENTRE = np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
REACH = np.array([0.15, 0.15, 1.0, 0.1, 0.3, 0.2])
# How the drawn tensions crowd at the lower limits, where a suspended bar's are.
CROWD = 3.0
STEP_S = 1e-3
# Another program that takes the processor leaves cold caches behind, which costs the next call some
# 80 µs: seldom the same call in two of three passes.
PASSES = 3
# A linear programme every so many steps, and at every step where the border is this near [N].
COARSE = 20
NEAR_BORDER = 0.2


class Wrenches(NamedTuple):
    """Wrenches (n, 6) at rows of bar and frame poses (n, 7), and which are solvable (n,)."""

    wrenches: Array
    bars: Array
    frames: Array
    solvable: NDArray[np.bool_]


class Score(NamedTuple):
    """What one method does with wrenches.

    Attributes:
        met: share of the solvable ones that it meets.
        residual: largest missing share of those that it says are met.
        wrong: how many tension sets are beyond the limits, or said to be met and not.
        step: largest change of a tension from one of them to the next [N].
        times: of the processor, for each the median of all passes [µs].
    """

    met: float
    residual: float
    wrong: int
    step: float
    times: Array


def drawn_wrenches(testbed: Testbed, count: int, seed: int) -> Wrenches:
    """Return wrenches that have a solution within the limits."""
    rng = np.random.default_rng(seed)
    limits = tension_limits(testbed)
    cables = nominal_parameters(testbed).cables
    rows, wrenches, bars = np.zeros(7), [], []
    for _ in range(count):
        pose = CENTRE + REACH * rng.uniform(-1.0, 1.0, 6)
        share = rng.uniform(size=len(limits)) ** CROWD
        tensions = limits[:, 0] + share * (limits[:, 1] - limits[:, 0])
        wrenches.append(-geometry(cables, pose, np.zeros(6)).bar.T @ tensions)
        pose_row(pose, rows)
        bars.append(rows.copy())
    frames = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (count, 1))
    return Wrenches(np.array(wrenches), np.array(bars), frames, np.ones(count, dtype=bool))


def reference_wrenches(bundle: Bundle) -> Wrenches:
    """Return the wrenches of a scenario's reference, one per millisecond."""
    testbed = bundle.testbed.testbed
    assert testbed.bar is not None
    bar = bar_parameters(testbed.bar, testbed.gravity)
    references = assembled(bundle).references
    count = round(bundle.scenario.duration / STEP_S)
    wrenches, bars, frames = np.empty((count, 6)), np.empty((count, 7)), np.empty((count, 7))
    motion = np.empty((3, 6))
    for k in range(count):
        stamp = k * round(STEP_S * 1e9)
        row = references["/bar/reference"].step(stamp)
        bars[k], frames[k] = row[:7], references["/winch_frame/reference"].step(stamp)[:7]
        wanted_motion(row, motion)
        wrench_for(*motion, bar, wrenches[k])
    return Wrenches(wrenches, bars, frames, _solvable(bundle, STEP_S * np.arange(count)))


def _solvable(bundle: Bundle, times: Array) -> NDArray[np.bool_]:
    """Return when a linear programme finds tensions for the reference, (n,)."""
    coarse = times[::COARSE]
    least = np.interp(times, coarse, least_tensions(bundle, coarse))
    room = least - tension_limits(bundle.testbed.testbed)[0, 0]
    near = np.abs(room) < NEAR_BORDER
    exact = least_tensions(bundle, times[near])
    room[near] = exact - tension_limits(bundle.testbed.testbed)[0, 0]
    return np.asarray(room > 0.0)


def score(testbed: Testbed, method: DistributionMethod, given: Wrenches) -> Score:
    """Put one method to the test."""
    limits = tension_limits(testbed)
    cables = nominal_parameters(testbed).cables
    solver = TensionDistribution(cables, limits, HowDistributed(method=method))
    solver.step(given.wrenches[0], given.bars[0], given.frames[0])
    count = len(given.wrenches)
    times, tensions = np.empty((PASSES, count)), np.empty((count, len(limits)))
    feasible, residual = np.empty(count, dtype=bool), np.empty(count)
    for each_pass in times:
        for k in range(count):
            begun = time.thread_time_ns()
            found = solver.step(given.wrenches[k], given.bars[k], given.frames[k])
            each_pass[k] = 1e-3 * (time.thread_time_ns() - begun)
            tensions[k], feasible[k], residual[k] = found.tensions, found.feasible, found.residual
    beyond = ((tensions < limits[:, 0]) | (tensions > limits[:, 1])).any(axis=1)
    said_met = feasible & (residual > 1e-6)
    return Score(
        met=float(feasible[given.solvable].mean()),
        residual=float(residual[feasible].max(initial=0.0)),
        wrong=int((beyond | said_met).sum()),
        step=float(np.abs(np.diff(tensions, axis=0)).max()),
        times=np.median(times, axis=0),
    )


def tension_limits(testbed: Testbed) -> Array:
    """Return the limits (n, 2) [N]."""
    return np.array([cable.tension_limits for cable in testbed.cables], dtype=float)


def distribution_rows(count: int, duration: float) -> list[list[str]]:
    """Return the table's rows, one per method."""
    bundle = Case("worst_case_steep", (f"duration={duration}",)).bundle()
    testbed = bundle.testbed.testbed
    drawn, options = drawn_wrenches(testbed, count, seed=1), reference_wrenches(bundle)
    rows = []
    for method in METHODS:
        whole, along = score(testbed, method, drawn), score(testbed, method, options)
        times = np.concatenate([whole.times, along.times])
        rows.append(
            [
                f"`{method}`",
                f"{whole.met:.2%}",
                f"{along.met:.2%}",
                f"{max(whole.residual, along.residual):.1e}",
                f"{whole.wrong + along.wrong}",
                f"{along.step:.2f}",
                f"{np.percentile(times, 50):.0f}",
                f"{np.percentile(times, 99):.0f}",
            ]
        )
    return rows


MET, RESIDUAL, P99 = "of all solvable wrenches met", "largest residual where met", "p99 [µs]"
HEADINGS = (
    "method",
    MET,
    "of the solvable instants of the worst case met",
    RESIDUAL,
    "wrong",
    "largest step, worst case [N/ms]",
    "p50 [µs]",
    P99,
)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.accuracy.tension_distribution")
    parser.add_argument("--count", type=int, default=20000, help="drawn wrenches")
    parser.add_argument("--duration", type=float, default=60.0, help="of the worst case [s]")
    options = parser.parse_args()
    console = Console()
    for key, value in describe_machine().items():
        console.print(f"{key}: {value}", highlight=False, soft_wrap=True)
    if is_busy():
        console.print("other programs are at work: the times will be too long")
    table = Table(*HEADINGS)
    for row in distribution_rows(options.count, options.duration):
        table.add_row(*row)
    console.print(table)


if __name__ == "__main__":
    main()
