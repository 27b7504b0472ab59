"""The plant's speed on one core, alone and against MuJoCo."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import partial

from bench.performance.measured_figure import Advance, Figure
from bench.performance.mujoco_model.machine import MujocoMachine
from bench.performance.processor_time import spent
from bench.performance.thesis_machine import FRICTION, PERIOD_NS, ThesisMachine, roll_damping

STEPS = 2000
THESIS_FACTOR = 2.077
PLANT = "plant, 1 kHz, Runge-Kutta 4"
AGAINST = "plant against MuJoCo, 1 kHz"


def plant_step(machine: ThesisMachine) -> float:
    """Return the processor time of a step of the plant, the median of several turns [µs]."""

    def advance() -> None:
        machine.rewind()
        machine.advance(0, 10 * STEPS)

    advance()
    return 1e6 * statistics.median(spent(advance) for _ in range(5)) / (10 * STEPS)


def measure_plant(repetitions: int, advance: Advance) -> list[Figure]:
    """Measure the plant without effects, with the file's, and with friction on all winches."""
    base = roll_damping()
    machines = [ThesisMachine(effects) for effects in ((), base, base + FRICTION)]
    lowest = min(machine.lowest_tension(STEPS) for machine in machines)
    if lowest <= 0.0:
        raise RuntimeError("a cable went slack: this would not measure what it says")
    factors: list[list[float]] = [[], [], []]
    for _ in range(repetitions):
        for machine, found in zip(machines, factors, strict=True):
            found.append(_factor(machine.rewind, partial(machine.advance, 0, STEPS)))
        advance(PLANT)
    frequency = [1e-3 * factor / (PERIOD_NS * 1e-9) for factor in factors[0]]
    runs = f"{repetitions} calls of {STEPS} steps"
    note = f"{runs}, winch frame in waves, torques held, all tensions ≥ {lowest:.1f} N"
    return [
        Figure(PLANT, "no effects", "1000 steps/s", frequency, note=note),
        Figure(
            PLANT,
            "no effects",
            "× real time",
            factors[0],
            at_least=400.0,
            note=f"the same; the thesis's simulation: {THESIS_FACTOR} × real time",
        ),
        Figure(PLANT, "roll damping", "× real time", factors[1], note="the same, in turns"),
        Figure(
            PLANT,
            "and friction on all winches",
            "× real time",
            factors[2],
            note="the same, in turns; Coulomb and viscous, 17 effects in all",
        ),
    ]


def measure_against_mujoco(repetitions: int, advance: Advance) -> list[Figure]:
    """Measure both in turns, so that each ratio is of two runs made side by side."""
    machine = ThesisMachine(())
    others = [MujocoMachine(machine.plant, integrator) for integrator in ("RK4", "Euler")]
    if min(other.least_stretch(STEPS) for other in others) <= 0.0:
        raise RuntimeError("a tendon went slack: this would not measure what it says")
    ours: list[float] = []
    theirs: list[list[float]] = [[], []]
    for _ in range(repetitions):
        ours.append(_factor(machine.rewind, partial(machine.advance, 0, STEPS)))
        for other, found in zip(others, theirs, strict=True):
            found.append(_factor(other.rewind, partial(other.advance, STEPS)))
        advance(AGAINST)
    ratios = [[a / b for a, b in zip(ours, found, strict=True)] for found in theirs]
    runs = f"{repetitions} calls of {STEPS} steps in turns with the plant"
    note = (
        "ratio of each two calls side by side; MuJoCo moves one body on 8 linear tendons (13"
        " states), the plant also 8 winches and the stiffness law (36 states)"
    )
    return [
        Figure(AGAINST, "MuJoCo, Runge-Kutta 4", "× real time", theirs[0], note=runs),
        Figure(AGAINST, "MuJoCo, Euler", "× real time", theirs[1], note=runs),
        Figure(AGAINST, "plant ÷ MuJoCo, both Runge-Kutta 4", "", ratios[0], 4.0, note=note),
        Figure(AGAINST, "plant ÷ MuJoCo with Euler", "", ratios[1], note="for information"),
    ]


def _factor(rewind: Callable[[], None], run: Callable[[], None]) -> float:
    rewind()
    began = time.perf_counter()
    run()
    return STEPS * PERIOD_NS * 1e-9 / (time.perf_counter() - began)
