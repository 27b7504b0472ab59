"""How far `hold` lets the bar go when commands are late, lost or stopped at random instants.

    python -m bench.faults.held_trips [--trips N] [--scenario NAME] [--seed S]

In simulation, on a clock of its own: what is found does not depend on the computer.
"""

from __future__ import annotations

import argparse
import multiprocessing
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import NamedTuple

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from bench.faults.wall_run import LOST, WallRun
from bench.performance.thesis_machine import shipped

KINDS = ("late", "jitter", "lost", "stopped")
_WARMED_S, _BETWEEN_S, _HELD_S = 6.0, (0.3, 1.5), 1.5
_WAITED_S = 0.5


class Trip(NamedTuple):
    """What became of a bar: time to the safe state [s], ways [m], speed [m/s], tension [N]."""

    kind: str
    took: float
    away: float
    vertical: float
    fastest: float
    tension: float


def drawn(kind: str, lateness: int, rng: np.random.Generator) -> Callable[[int], int | None]:
    """Return a way that is too late from now on; `lateness` is what is allowed [ns]."""
    if kind == "late":
        delay = round(lateness * (1.01 + 10.0 * rng.random()))
        return lambda _: delay
    if kind == "jitter":
        return lambda _: round(lateness * 4.0 * rng.random())
    if kind == "lost":
        return lambda _: LOST if rng.random() < 0.97 else 0
    return lambda _: LOST


def struck(run: WallRun, kind: str, rng: np.random.Generator) -> Trip:
    """Return what becomes of the bar when commands fail from now on.

    Raises:
        RuntimeError: the drives do not go to their safe state.
    """
    before, per_s = run.parts.plant.bar_state[:3].copy(), 1e9 / run.period
    run.way = drawn(kind, run.lateness or 0, rng)
    steps = run.until_safe(round(_WAITED_S * per_s))
    places, tensions = run.go(round(_HELD_S * per_s))
    ways = places - before
    away, vertical = np.linalg.norm(ways, axis=1).max(), np.abs(ways[:, 2]).max()
    fastest = np.linalg.norm(np.diff(places, axis=0), axis=1).max() * per_s
    return Trip(kind, steps / per_s, *map(float, (away, vertical, fastest, tensions.max())))


def trips(run: WallRun, count: int, seed: int) -> Iterator[Trip]:
    """Yield what became of the bar at so many instants, each kind in turn.

    The run itself goes on undisturbed; what trips is a fork of its process.

    Raises:
        RuntimeError: the drives did not go to their safe state.
    """
    rng, forks = np.random.default_rng(seed), multiprocessing.get_context("fork")
    run.go(round(_WARMED_S * 1e9 / run.period))
    for i in range(count):
        run.go(round(float(rng.uniform(*_BETWEEN_S)) * 1e9 / run.period))
        mine, theirs = forks.Pipe(duplex=False)
        arguments = (theirs, run, KINDS[i % len(KINDS)], np.random.default_rng((seed, i)))
        process = forks.Process(target=_tell, args=arguments)
        process.start()
        theirs.close()
        found = mine.recv()
        process.join()
        if isinstance(found, str):
            raise RuntimeError(found)
        yield found


def _tell(to: Connection, run: WallRun, kind: str, rng: np.random.Generator) -> None:
    try:
        to.send(struck(run, kind, rng))
    except RuntimeError as err:
        to.send(str(err))


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.faults.held_trips", description=__doc__)
    parser.add_argument("--trips", type=int, default=200)
    parser.add_argument("--scenario", default="worst_case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--set", action="append", default=[], help="a value of the scenario")
    options = parser.parse_args()
    bundle, console = shipped(options.scenario, *options.set), Console(width=100)
    with bundle.unpacked() as folder:
        found = []
        for trip in trips(WallRun(folder, bundle), options.trips, options.seed):
            found.append(trip)
            if len(found) % 20 == 0:
                console.print(f"{len(found)} trips, farthest {max(t.away for t in found):.3f} m")
    table = Table(box=SIMPLE_HEAD)
    for title in ("commands", "trips", "safe after, ms", "away, m", "up or down, m"):
        table.add_column(title, justify="right")
    for title in ("speed, m/s", "tension, N"):
        table.add_column(title, justify="right")
    for kind in KINDS:
        of = [trip for trip in found if trip.kind == kind]
        if of:
            most = np.max([trip[1:] for trip in of], axis=0)
            numbers = (f"{1e3 * most[0]:.0f}", *(f"{each:.3f}" for each in most[1:4]))
            table.add_row(kind, str(len(of)), *numbers, f"{most[4]:.1f}")
    console.print(table)


if __name__ == "__main__":
    main()
