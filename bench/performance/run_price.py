"""What a simulated second costs: against duration, cables, effects, MuJoCo and the processor.

    python -m bench.performance.run_price

Processor time of all threads, without what building the run costs, at the rates of each scenario.
With JAX (`pip install jax`) also the floating-point operations of a plant step, which its compiler
counts, beside what this core makes of them in products of matrices.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from bench.performance.thesis_machine import (
    FRICTION,
    PERIOD_NS,
    ThesisMachine,
    roll_damping,
    shipped,
)
from cspm_msgs_py.recording.run_record import MUJOCO
from cspm_run.bundle import Bundle
from cspm_run.recorded_run import run, steps_of

_REPEATS, _FEW_STEPS = 3, 100
_PLANT_S = 20.0
# Of the thesis's machine and others, by their number of cables.
_MACHINES = (
    "one_winch",
    "robots/planar_kntu",
    "robots/suspended_four",
    "robots/robocrane",
    "robots/cogiro",
)
_MATRIX = 512


def main() -> None:
    """Run the command line."""
    console = Console()
    table = Table("closed loop, not recorded", "cables", "processor time of a second [ms]")
    for duration in (10.0, 60.0, 300.0):
        bundle = shipped("worst_case", f"duration={duration}")
        table.add_row(f"worst_case, {duration:g} s", "8", f"{_price(bundle):.2f}")
    for name in _MACHINES:
        bundle = shipped(name, "duration=20")
        cables = len(bundle.testbed.testbed.cables)
        table.add_row(f"{name}, 20 s", str(cables), f"{_price(bundle):.2f}")
    bundle = replace(shipped("worst_case", "duration=20"), plant=MUJOCO)
    table.add_row("worst_case, 20 s, MuJoCo's plant, loop in Python", "8", f"{_price(bundle):.2f}")
    console.print(table)
    console.print(_plants())
    console.print(_operations())


def _price(bundle: Bundle) -> float:
    """Return what a simulated second costs [ms] beyond what building the run does."""
    steps = steps_of(bundle)
    run(bundle, None, steps=_FEW_STEPS)
    seconds = bundle.scenario.duration * (1.0 - _FEW_STEPS / steps)
    costs = [
        _spent(lambda: run(bundle, None, steps=steps))
        - _spent(lambda: run(bundle, None, steps=_FEW_STEPS))
        for _ in range(_REPEATS)
    ]
    return 1e3 * statistics.median(costs) / seconds


def _plants() -> Table:
    """Return what effects on the plant cost."""
    table = Table("plant alone, 8 cables", "effects", "processor time of a step [µs]")
    base = roll_damping()
    for name, effects, count in (
        ("nothing added", (), 0),
        ("the file's roll damping", base, len(base)),
        ("and friction on all winches", base + FRICTION, len(base) + 16),
    ):
        table.add_row(name, str(count), f"{_step(ThesisMachine(effects)):.2f}")
    return table


def _step(machine: ThesisMachine) -> float:
    """Return the processor time of a plant step [µs]."""
    steps = round(_PLANT_S / (PERIOD_NS * 1e-9))

    def advance() -> None:
        machine.rewind()
        machine.advance(0, steps)

    advance()
    return 1e6 * statistics.median(_spent(advance) for _ in range(_REPEATS)) / steps


def _operations() -> str:
    """Return the plant's floating-point operations beside what the core can make of them."""
    try:
        from bench.performance.jax_batch import PlantVariants
        from bench.performance.jax_plant import make_rate, operations_of
    except ImportError:
        return "floating-point operations: not counted, JAX is not installed"
    batch = PlantVariants(1)
    count = operations_of(make_rate(batch.plant.parameters, batch.frame_pose), batch.states[0])
    took, most = _step(ThesisMachine(())), _rate_of_products()
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
        took = min(_spent(lambda: matrix @ matrix) for _ in range(10))
    return 2.0 * _MATRIX**3 / took


def _spent(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun


if __name__ == "__main__":
    main()
