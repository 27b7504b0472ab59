"""How much the loop around the plant costs: processor time against that of the plant alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import cspm
from bench.performance.measured_figure import Advance, Figure
from bench.performance.processor_time import FEW_STEPS, loop_cost, run_steps, spent
from bench.performance.thesis_machine import SCENARIOS, ThesisMachine, roll_damping, worst_case
from cspm_run.bundle import Bundle

GROUP = "speed as a share of the plant's alone, worst case"
VARIANTS = 8
# Plant steps per second of simulated time.
RATE = 1000
UNIT = "of the plant"


def measure_loop_share(repetitions: int, duration: float, advance: Advance) -> list[Figure]:
    """Measure `duration` [s] of plant and loops in turns; each share is of one turn."""
    machine = ThesisMachine(roll_damping())
    plain, centre = worst_case(duration), _with_centre(duration)
    loops: dict[str, tuple[float, Callable[[], float]]] = {
        "closed loop, pseudo-inverse": (1 / 5, lambda: loop_cost(plain, recorded=False)),
        "closed loop, analytic centre": (1 / 8, lambda: loop_cost(centre, recorded=False)),
        "recorded, pseudo-inverse": (1 / 15, lambda: loop_cost(plain, recorded=True)),
        f"{VARIANTS} variants, pseudo-inverse": (1 / 2.5, lambda: _batch_cost(duration)),
    }
    shares: dict[str, list[float]] = {name: [] for name in loops}
    for bundle in (plain, centre):
        # What is loaded once is no part of it either.
        run_steps(bundle, FEW_STEPS, recorded=True)
    for _ in range(repetitions):
        for name, (_, cost) in loops.items():
            alone = _plant_cost(machine, duration)
            shares[name].append(alone / cost())
        advance(GROUP)
    note = f"{repetitions} turns of {duration:g} s, processor time of all threads, all rates 1 kHz"
    return [
        Figure(GROUP, name, UNIT, shares[name], at_least=reach, note=note)
        for name, (reach, _) in loops.items()
    ]


def _with_centre(duration: float) -> Bundle:
    found = worst_case(duration)
    control = found.scenario.control
    method = control.tension_distribution.model_copy(update={"method": "analytic_centre"})
    control = control.model_copy(update={"tension_distribution": method})
    return replace(found, scenario=found.scenario.model_copy(update={"control": control}))


def _plant_cost(machine: ThesisMachine, duration: float) -> float:
    """Return what a simulated second costs [s]."""
    machine.rewind()
    return spent(lambda: machine.advance(0, round(RATE * duration))) / duration


def _batch_cost(duration: float) -> float:
    """Return what a simulated second of a variant costs [s] beyond what building it does."""

    def batch(long: float) -> None:
        scenario = cspm.load_scenario(SCENARIOS / "worst_case.yaml")
        seeds = [{"scenario": scenario, "duration": long, "seed": i} for i in range(VARIANTS)]
        for _ in cspm.simulate_many(seeds, signals=()):
            pass

    short = FEW_STEPS / RATE
    first, last = (spent(lambda long=long: batch(long)) for long in (short, duration))
    return (last - first) / (VARIANTS * (duration - short))
