"""What a simulated second costs: against duration, cables, effects, MuJoCo and the processor.

    python -m bench.performance.run_price [--figure FILE.png]

Processor time of all threads, without what building the run costs, at the rates of each scenario.
With JAX (`pip install jax`) also the floating-point operations of a plant step, which its compiler
counts, beside what this core makes of them in products of matrices.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from bench.performance.mujoco_model.loop import loop_ways
from bench.performance.mujoco_model.machine import MujocoMachine
from bench.performance.plant_speed import STEPS, plant_step
from bench.performance.processor_time import FEW_STEPS, loop_cost, run_steps, spent
from bench.performance.thesis_machine import (
    FRICTION,
    ThesisMachine,
    roll_damping,
    shipped,
)
from cspm.plots.picture_style import COLOURS, large_letters, save
from cspm_msgs_py.recording.run_record import MUJOCO
from cspm_run.bundle import Bundle

_REPEATS = 3
# Of the thesis's machine and others, by their number of cables.
_MACHINES = (
    "one_winch",
    "robots/planar_kntu",
    "robots/suspended_four",
    "robots/robocrane",
    "robots/cogiro",
)
_SETTINGS = {
    "worst_case, analytic centre": "control.tension_distribution={method: analytic_centre}",
    "worst_case, winch feedforward": "control.force.winch_feedforward={stretch_bandwidth: 200}",
}
_MATRIX = 512


class Price(NamedTuple):
    """What a simulated second of something costs of the processor [ms]."""

    what: str
    cables: int
    cost: float


# What is measured, its number of cables, and what returns its price [ms].
Way = tuple[str, int, Callable[[], float]]


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.performance.run_price",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--figure", type=Path, help="a picture of the prices, PNG and SVG")
    options = parser.parse_args()
    console, prices = Console(), _prices()
    for each in prices:
        console.print(f"{each.what}, {each.cables} cables: {each.cost:.2f} ms", highlight=False)
    console.print(_plants())
    console.print(_operations())
    if options.figure is not None:
        _draw(options.figure, prices)


def _prices() -> list[Price]:
    """Return the price of the plant alone, of closed loops, and of recorded and other ones.

    Each is the median of several rounds, so that what the machine does meanwhile touches all.
    """
    ways = [*_plants_alone(), *loop_ways(), *_closed_loops()]
    rounds = [[measure() for _, _, measure in ways] for _ in track(range(_REPEATS), "measuring")]
    medians = [statistics.median(costs) for costs in zip(*rounds, strict=True)]
    return [Price(what, n, cost) for (what, n, _), cost in zip(ways, medians, strict=True)]


def _plants_alone() -> Iterator[Way]:
    machine = ThesisMachine(())
    yield "plant alone", 8, lambda: plant_step(machine)
    for integrator in ("RK4", "Euler"):
        other = MujocoMachine(machine.plant, integrator)
        what = f"MuJoCo, {integrator}, steps alone, no winches"
        yield what, 8, lambda other=other: _mujoco_step(other)  # type: ignore[misc]


def _mujoco_step(machine: MujocoMachine) -> float:
    machine.rewind()
    return 1e6 * spent(lambda: machine.advance(STEPS)) / STEPS


def _closed_loops() -> Iterator[Way]:
    for duration in (10.0, 60.0, 300.0):
        yield f"worst_case, {duration:g} s", 8, partial(_price, _worst(duration))
    for name in _MACHINES:
        bundle = shipped(name, "duration=20")
        count = len(bundle.testbed.testbed.cables)
        yield name.rpartition("/")[2], count, partial(_price, bundle)
    for what, setting in _SETTINGS.items():
        yield what, 8, partial(_price, _worst(20.0, setting))
    yield "worst_case, recorded", 8, partial(_price, _worst(20.0), recorded=True)
    in_python = replace(_worst(20.0), plant=MUJOCO)
    yield "worst_case, MuJoCo's plant, loop in Python", 8, partial(_price, in_python)


def _worst(duration: float, *settings: str) -> Bundle:
    return shipped("worst_case", f"duration={duration:g}", *settings)


def _draw(path: Path, prices: Sequence[Price]) -> None:
    """Draw the prices as bars, the plant's first."""
    with large_letters():
        figure, axes = plt.subplots(figsize=(11.0, 0.45 * len(prices) + 1.2), layout="constrained")
        names = [f"{each.what} ({each.cables})" for each in prices]
        bars = axes.barh(names, [each.cost for each in prices], color=COLOURS[0])
        axes.bar_label(bars, [f"{each.cost:.3g}" for each in prices], padding=4)
        axes.set_xscale("log")
        axes.margins(x=0.12)
        axes.invert_yaxis()
        axes.set_xlabel("processor time of a simulated second, ms")
        save(figure, path)


def _price(bundle: Bundle, *, recorded: bool = False) -> float:
    """Return what a simulated second costs [ms] beyond what building the run does."""
    run_steps(bundle, FEW_STEPS, recorded)
    return 1e3 * loop_cost(bundle, recorded=recorded)


def _plants() -> Table:
    """Return what effects on the plant cost."""
    table = Table("plant alone, 8 cables", "effects", "processor time of a step [µs]")
    base = roll_damping()
    for name, effects, count in (
        ("nothing added", (), 0),
        ("the file's roll damping", base, len(base)),
        ("and friction on all winches", base + FRICTION, len(base) + 16),
    ):
        table.add_row(name, str(count), f"{plant_step(ThesisMachine(effects)):.2f}")
    return table


def _operations() -> str:
    """Return the plant's floating-point operations beside what the core can make of them."""
    try:
        from bench.performance.jax_batch import PlantVariants
        from bench.performance.jax_plant import make_rate, operations_of
    except ImportError:
        return "floating-point operations: not counted, JAX is not installed"
    batch = PlantVariants(1)
    count = operations_of(make_rate(batch.plant.parameters, batch.frame_pose), batch.states[0])
    took, most = plant_step(ThesisMachine(())), _rate_of_products()
    return (
        f"a plant step has {count:.0f} floating-point operations: {1e-3 * count / took:.2f} · 10⁹"
        f" a second, where products of matrices make {1e-9 * most:.0f} · 10⁹ (limit:"
        f" {1e6 * count / most:.2f} µs a step)"
    )


def _rate_of_products() -> float:
    """Return floating-point operations a second of one core in products of matrices."""
    from threadpoolctl import threadpool_limits

    matrix = np.random.default_rng(1).standard_normal((_MATRIX, _MATRIX))
    with threadpool_limits(1):
        matrix @ matrix
        took = min(spent(lambda: matrix @ matrix) for _ in range(10))
    return 2.0 * _MATRIX**3 / took


if __name__ == "__main__":
    main()
