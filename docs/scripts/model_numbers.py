"""The numbers quoted in `docs/explanation/model.md`, from the thesis's test-bed by this code.

Run `python docs/scripts/model_numbers.py`; the page holds what it writes, as a test checks.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from cspm_model.motion import Motion
from cspm_model.stiffness import law_slope, law_table
from cspm_msgs_py.testbed import Cable, ExponentialStiffness, Testbed, load_testbed
from cspm_sim.plant import Plant

Array = NDArray[np.float64]

TESTBED = Path(__file__).resolve().parents[2] / "scenarios" / "testbeds" / "thesis.yaml"
CLASSES = {"hoist": 0, "surge": 2, "sway": 4}  # index of each class's first cable
OPERATING_POINT = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)
TENSION = 5.0  # N, near every cable's tension at the operating point
FLOORS = (0.01, 0.05, 0.2)  # N
RUNGE_KUTTA_PERIOD_NS = 10_000


class Law(NamedTuple):
    """One cable's stiffness law at a fixed elastic length [m]."""

    law: ExponentialStiffness
    elastic_length: float
    tension_limit: float

    @property
    def scale(self) -> float:
        """a/l^b [N/m]."""
        return float(self.law.a / self.elastic_length**self.law.b)

    @property
    def cap(self) -> float:
        """E·A/l [N/m]."""
        return self.law.axial_rigidity / self.elastic_length

    def stiffness(self, tension: Array | float) -> Array:
        """k(l, t) of (3-7) without floor and cap [N/m]."""
        c, d = self.law.c, self.law.d
        return self.scale * (np.exp(c * np.asarray(tension)) - np.exp(d * np.asarray(tension)))

    def cap_tension(self) -> float:
        """Tension at which (3-7) meets the cap [N]."""
        tensions = np.linspace(0.1, 2.0 * self.tension_limit, 200_001)
        return float(np.interp(self.cap, self.stiffness(tensions), tensions))

    def secant_incremental(self, tension: float) -> float:
        """dt/dε of t = k(t)·ε: k²/(k − t·dk/dt) [N/m]."""
        c, d = self.law.c, self.law.d
        slope = self.scale * (c * np.exp(c * tension) - d * np.exp(d * tension))
        k = float(self.stiffness(tension))
        return float(k**2 / (k - tension * slope))

    def secant_least(self) -> float:
        """Smallest dt/dε of t = k(t)·ε up to the cap [N/m]."""
        tensions = np.linspace(1e-3, self.cap_tension(), 2001)
        return min(self.secant_incremental(float(tension)) for tension in tensions)

    def dead_stretch(self) -> float:
        """Elongation at which the secant reading's tension starts, lim t/k(t) for t → 0 [m]."""
        return float(1.0 / (self.scale * (self.law.c - self.law.d)))

    def tangent_elongation(self, tension: float, floor: float) -> float:
        """Elongation at `tension` in the tangent reading with a floor tension [m]."""
        t = np.geomspace(floor, tension, 20_001)
        beyond = np.trapezoid(t / self.stiffness(t), np.log(t))
        return float(floor / self.stiffness(floor) + beyond)


def thesis_plant(
    period_ns: int = 1_000_000,
    pose: tuple[float, ...] = OPERATING_POINT,
    load: float = 1.0,
    file: Path = TESTBED,
) -> Plant:
    """Return the thesis's machine at rest without effects, its bar `load` times as heavy."""
    testbed = _loaded(load_testbed(file).testbed, load)
    return Plant(testbed, Motion.still(np.zeros(6)), period_ns, bar_pose=pose)


def thesis_laws(file: Path = TESTBED) -> dict[str, Law]:
    """Return each class's law at its elastic length at the operating point."""
    plant = thesis_plant(file=file)
    return {
        name: Law(
            _law(plant.testbed.cables[i]),
            float(plant.unstretched_lengths[i] + plant.testbed.cables[i].offset_length),
            _limit(plant.testbed.cables[i]),
        )
        for name, i in CLASSES.items()
    }


def poles(plant: Plant) -> Array:
    """Return the plant's eigenvalues [1/s] about its state, from steps of perturbed states."""
    period = plant.period_ns * 1e-9
    rest = plant.state.copy()
    torque = holding_torque(plant)
    columns = []
    for i in range(len(rest)):
        ends = []
        for delta in (1e-6, -1e-6):
            plant.state[:] = rest
            plant.state[i] += delta
            plant.step(torque)
            ends.append(plant.state.copy())
        columns.append((ends[0] - ends[1]) / 2e-6)
    plant.state[:] = rest
    return np.asarray(np.log(np.linalg.eigvals(np.array(columns).T).astype(complex)) / period)


def holding_torque(plant: Plant) -> Array:
    """Return the torques that hold the present tensions, (r/n)·t [N·m]."""
    radius = [cable.drum_radius / cable.gear_ratio for cable in plant.testbed.cables]
    return np.asarray(plant.tensions * np.array(radius))


def longest_stable_step(values: Array) -> float:
    """Return the longest step [s] at which classical Runge-Kutta damps all damped `values`."""
    damped = values[values.real < -0.5]
    steps = np.linspace(1e-4, 0.2, 20_000)
    z = damped[:, None] * steps
    growth = np.abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24).max(axis=0)
    return float(steps[np.argmax(growth > 1.0) - 1])


def table_error(law: Law) -> float:
    """Return the largest error of the kernels' table against an independent integration [N]."""
    table, step = law_table(law.law, law.tension_limit)
    end = step * (len(table) - 1)
    s = np.linspace(0.0, end, 7919)
    solution = solve_ivp(
        lambda _, t: law_slope(law.law, t),
        (0.0, end),
        [law.law.floor_tension],
        method="Radau",
        t_eval=s,
        rtol=1e-11,
        atol=1e-12,
    )
    j = np.minimum((s / step).astype(int), len(table) - 2)
    x = s / step - j
    (t0, g0), (t1, g1) = table[j].T, table[j + 1].T
    basis = (1 + 2 * x) * (1 - x) ** 2, x * (1 - x) ** 2, x**2 * (3 - 2 * x), x**2 * (x - 1)
    found = basis[0] * t0 + basis[1] * g0 * step + basis[2] * t1 + basis[3] * g1 * step
    return float(np.abs(found - solution.y[0]).max())


def _law(cable: Cable) -> ExponentialStiffness:
    if not isinstance(cable.stiffness, ExponentialStiffness):
        raise TypeError(f"{cable.name}: {type(cable.stiffness).__name__}")
    return cable.stiffness


def _limit(cable: Cable) -> float:
    return cable.tension_limits[1] if cable.tension_limits else float("nan")


def _loaded(testbed: Testbed, load: float) -> Testbed:
    bar = testbed.bar
    if bar is None:
        raise TypeError("the test-bed has no bar")
    inertia = {key: load * value for key, value in bar.inertia.model_dump().items()}
    heavy = bar.model_copy(
        update={"mass": load * bar.mass, "inertia": bar.inertia.model_copy(update=inertia)}
    )
    return testbed.model_copy(update={"bar": heavy, "effects": ()})


def _row(title: str, unit: str, values: Iterable[float], digits: int = 3) -> str:
    numbers = " | ".join(f"{value:.{digits}f}" for value in values)
    return f"| {title} | {unit} | {numbers} |"


def law_lines() -> list[str]:
    """Return the table that compares the readings of the stiffness law."""
    laws = list(thesis_laws().values())
    rows = [
        _row("elastic length l", "m", (x.elastic_length for x in laws)),
        _row("cap E·A/l (3-10)", "N/m", (x.cap for x in laws), 0),
        _row("(3-7) meets the cap at", "N", (x.cap_tension() for x in laws), 1),
        _row("secant: dead zone ε₀", "mm", (1e3 * x.dead_stretch() for x in laws), 2),
        _row("secant: dt/dε at ε₀", "N/m", (x.secant_incremental(1e-4) for x in laws), 0),
        _row("secant: least dt/dε up to the cap", "N/m", (x.secant_least() for x in laws), 0),
        _row("secant: dt/dε at 5 N", "N/m", (x.secant_incremental(TENSION) for x in laws), 0),
        _row("secant: ε at 5 N", "mm", (5e3 / float(x.stiffness(TENSION)) for x in laws), 2),
        _row("tangent: dt/dε at 5 N", "N/m", (float(x.stiffness(TENSION)) for x in laws), 0),
        _row(
            "tangent: dt/dε at and below the floor",
            "N/m",
            (float(x.stiffness(x.law.floor_tension)) for x in laws),
            1,
        ),
    ]
    rows += [
        _row(
            f"tangent, floor {floor:g} N: ε at 5 N",
            "mm",
            (1e3 * x.tangent_elongation(TENSION, floor) for x in laws),
            2,
        )
        for floor in FLOORS
    ]
    return ["| quantity | unit | hoist | surge | sway |", "|---|---|---|---|---|", *rows]


def step_lines() -> list[str]:
    """Return the table of the plant's fastest motions and the steps that they allow."""
    cases = {
        "z = 0.5 m": thesis_plant(RUNGE_KUTTA_PERIOD_NS, (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)),
        "z = 2 m": thesis_plant(RUNGE_KUTTA_PERIOD_NS),
        "z = 2 m, bar 2.5 × as heavy": thesis_plant(RUNGE_KUTTA_PERIOD_NS, load=2.5),
        "z = 4 m": thesis_plant(RUNGE_KUTTA_PERIOD_NS, (0.0, 0.0, 4.0, 0.0, 0.0, 0.0)),
    }
    lines = [
        "| at rest at | fastest pole, 1/s | fastest oscillation, rad/s | longest stable step, ms |",
        "|---|---|---|---|",
    ]
    for name, plant in cases.items():
        found = poles(plant)
        lines.append(
            f"| {name} | {np.abs(found).max():.0f} | {np.abs(found[found.imag > 0.1]).max():.0f} |"
            f" {1e3 * longest_stable_step(found):.0f} |"
        )
    return lines


def winding_lines() -> list[str]:
    """Return the table of the winding factor and of the damper's step that fading avoids."""
    plant = thesis_plant()
    ratios = plant.unstretched_lengths / plant.lengths
    dampings = {}
    for name, i in CLASSES.items():
        damping = plant.testbed.cables[i].damping
        length = plant.unstretched_lengths[i] + plant.testbed.cables[i].offset_length
        if damping is not None:
            dampings[name] = damping.factor * (damping.constant - damping.slope * length)
    return [
        "| quantity | unit | hoist | surge | sway |",
        "|---|---|---|---|---|",
        _row("l0/l", "1", (ratios[i] for i in CLASSES.values()), 4),
        _row("damper B", "N·s/m", dampings.values(), 1),
    ]


def report() -> str:
    """Return all tables, under the names by which the page marks them."""
    parts = {"law": law_lines(), "step": step_lines(), "winding": winding_lines()}
    return "".join(
        f"<!-- numbers: {name} -->\n" + "\n".join(lines) + "\n<!-- end -->\n\n"
        for name, lines in parts.items()
    )


if __name__ == "__main__":
    sys.stdout.write(report())
