"""The energy balance of the machine with free winches, and the share that winding cable takes.

Run `python docs/scripts/winding_energy.py`. It simulates the thesis's machine under torques that
swing about those that hold it, and adds up all works and energies; see `docs/explanation/model.md`.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
from model_numbers import holding_torque, thesis_plant
from numpy.typing import NDArray
from scipy.integrate import simpson

from cspm_model.kernels.cable import LAW_EXPONENT, OFFSET_LENGTH, RADIUS, elastic_tension, law_scale
from cspm_model.kinematics import geometry, rotation
from cspm_msgs_py.testbed import ExponentialStiffness
from cspm_sim.plant import Plant

Array = NDArray[np.float64]

DURATION = 12.0  # s
SWING = 0.03  # of the holding torque
FREQUENCY = 0.5  # Hz


class Powers(NamedTuple):
    """Energy [J] and powers [W] at one instant."""

    energy: float
    damped: float
    wound: float


class Balance(NamedTuple):
    """What a run's energy consists of [J]."""

    gain: float
    work: float
    damped: float
    wound: float

    @property
    def residual(self) -> float:
        """What the other terms leave unexplained."""
        return self.gain - self.work + self.damped - self.wound


class StoredEnergy:
    """V/(l^b/a) of each cable's law as a function of scaled elongation, by integrated tension."""

    def __init__(self, plant: Plant) -> None:
        """Integrate the tension of each cable's law over a grid that covers the run."""
        self.plant = plant
        cables, tables = plant.parameters.cables, plant.parameters.tables
        self.grids, self.sums = [], []
        for i, cable in enumerate(plant.testbed.cables):
            if not isinstance(cable.stiffness, ExponentialStiffness):
                raise TypeError(cable.name)
            elastic = plant.unstretched_lengths[i] + cables[i, OFFSET_LENGTH]
            scale = law_scale(elastic, cables, i)
            top = 1.1 * (plant.lengths[i] - plant.unstretched_lengths[i])
            grid = np.linspace(0.0, top, 20_001)
            tension = [elastic_tension(e, elastic, scale, cables, tables, i)[0] for e in grid]
            steps = 0.5 * np.diff(grid) * (np.array(tension[1:]) + tension[:-1])
            self.grids.append(scale * grid)
            self.sums.append(scale * np.concatenate([[0.0], np.cumsum(steps)]))

    def of(self, i: int, elongation: float, scale: float) -> float:
        """Return V of cable i [J]."""
        return float(np.interp(scale * elongation, self.grids[i], self.sums[i])) / scale


def powers(plant: Plant, stored: StoredEnergy) -> Powers:
    """Return energy, the dampers' power and l̇0·(tε/l0 + ∂V/∂l0) at the plant's present state."""
    cables, tables = plant.parameters.cables, plant.parameters.tables
    state = plant.bar_state
    twist = np.concatenate([state[6:9], rotation(state[:6]) @ state[9:12]])
    shape = geometry(cables, state[:6], plant.frame[:6])
    unstretched = plant.unstretched_lengths
    winding = -unstretched / shape.lengths * cables[:, RADIUS] * plant.speeds
    stretching = shape.bar @ twist - winding
    elastic_lengths = unstretched + cables[:, OFFSET_LENGTH]
    energy, damped, wound = _rigid_energy(plant), 0.0, 0.0
    for i, (length, elongation) in enumerate(
        zip(elastic_lengths, shape.lengths - unstretched, strict=True)
    ):
        scale = law_scale(length, cables, i)
        elastic, _ = elastic_tension(elongation, length, scale, cables, tables, i)
        potential = stored.of(i, elongation, scale)
        slope = -cables[i, LAW_EXPONENT] / length * (elastic * elongation - potential)
        energy += potential
        damped += (plant.tensions[i] - elastic) * stretching[i]
        wound += winding[i] * (plant.tensions[i] * elongation / unstretched[i] + slope)
    return Powers(energy, float(damped), float(wound))


def _rigid_energy(plant: Plant) -> float:
    bar, state = plant.testbed.bar, plant.bar_state
    if bar is None:
        raise TypeError("the test-bed has no bar")
    rotors = np.array([cable.rotor_inertia for cable in plant.testbed.cables])
    turning = 0.5 * state[9:12] @ bar.inertia.matrix @ state[9:12] + 0.5 * rotors @ plant.speeds**2
    moving = 0.5 * bar.mass * state[6:9] @ state[6:9]
    return float(turning + moving - bar.mass * plant.testbed.gravity * state[2])


def energy_balance() -> Balance:
    """Simulate the machine and return its energy balance."""
    plant = thesis_plant()
    stored = StoredEnergy(plant)
    rest = holding_torque(plant)
    period = plant.period_ns * 1e-9
    rows, work = [powers(plant, stored)], 0.0
    for k in range(round(DURATION / period)):
        phase = 2.0 * np.pi * FREQUENCY * k * period
        torque = rest * (1.0 + SWING * np.sin(phase + np.arange(len(rest))))
        before = plant.angles.copy()
        plant.step(torque)
        work += float(torque @ (plant.angles - before))
        rows.append(powers(plant, stored))
    energy, damped, wound = np.array(rows).T
    return Balance(
        float(energy[-1] - energy[0]),
        work,
        float(simpson(damped, dx=period)),
        float(simpson(wound, dx=period)),
    )


def report() -> str:
    """Return the balance as a table."""
    found = energy_balance()
    names = {
        "gain of energy": found.gain,
        "work of the motors": found.work,
        "lost in the dampers": found.damped,
        "∫ l̇0·(t·ε/l0 + ∂V/∂l0) dt": found.wound,
        "left over, absolute": abs(found.residual),
    }
    rows = [f"| {name} | {1e3 * value:.2f} |" for name, value in names.items()]
    return "\n".join(["<!-- numbers: energy -->", "| term | mJ |", "|---|---|", *rows])


if __name__ == "__main__":
    sys.stdout.write(report() + "\n<!-- end -->\n")
