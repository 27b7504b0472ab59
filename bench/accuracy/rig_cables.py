"""Cables on a rig that the project's plant did not make: closed forms and scipy's quadrature."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.signal import lfilter

from cspm_ident.rig.specimen import Specimen
from cspm_msgs_py.testbed import Cable
from cspm_msgs_py.yaml_file import validate

RATE = 1000.0  # Hz
RADIUS = 0.025  # m
SHA = "ab" * 32


class SpecimenTruth(NamedTuple):
    """A cable: dt/dε = min(a/l0^b (e^{ct} − e^{dt}), E·A/l0) with its damper and Dahl's hysteresis.

    Below `floor` the slope stays, as a cable cannot start from a slope of zero.
    """

    a: float = 9000.0
    b: float = 0.9
    c: float = 0.004
    d: float = -0.09
    youngs_modulus: float = 7.5e9
    diameter: float = 1.2e-3
    floor: float = 0.05
    constant: float = 12.0
    slope: float = 1.5
    dahl_force: float = 0.0
    dahl_scale: float = 3.0e-4

    @property
    def rigidity(self) -> float:
        """E·A [N]."""
        return self.youngs_modulus * np.pi / 4.0 * self.diameter**2

    @property
    def law(self) -> dict[str, Any]:
        """The stiffness as a test-bed file writes it."""
        names = ("a", "b", "c", "d", "youngs_modulus", "diameter")
        known = {name: getattr(self, name) for name in names}
        return {"law": "exponential", **known, "floor_tension": self.floor}

    def stiffness(self, tension: np.ndarray, length: float) -> np.ndarray:
        """Return k [N/m] at tensions [N] and an elastic length [m]."""
        t = np.maximum(tension, self.floor)
        bend = self.a / length**self.b * (np.exp(self.c * t) - np.exp(self.d * t))
        return np.minimum(bend, self.rigidity / length)

    def damping(self, length: float | np.ndarray) -> float | np.ndarray:
        """Return b [N·s/m] at an elastic length [m]."""
        return self.constant - self.slope * length

    def elastic(
        self, elongation: np.ndarray, unstretched: np.ndarray, highest: float
    ) -> np.ndarray:
        """Return tensions: each the inverse of ε(t) = ∫ dτ/k(l0, τ) at its own l0."""
        grid = np.concatenate([np.linspace(0.0, 2.0, 800)[:-1], np.linspace(2.0, highest, 1200)])
        found = np.empty_like(elongation)
        for i, (stretch, length) in enumerate(zip(elongation, unstretched, strict=True)):
            curve = cumulative_simpson(1.0 / self.stiffness(grid, length), x=grid, initial=0.0)
            found[i] = np.interp(stretch, curve, grid)
        return found


def described(length: float, truth: SpecimenTruth, label: str = "only", **changes: Any) -> Cable:
    """Return the cable as a test-bed file that knows its sizes and not its law would give it."""
    law = {
        "law": "exponential",
        "a": 5000.0,
        "b": 1.0,
        "c": 0.01,
        "d": -0.2,
        "youngs_modulus": 1.0e10,
        "diameter": truth.diameter,
        "floor_tension": truth.floor,
    }
    content = {
        "name": label,
        "exit": [0.0, 0.0, 0.0],
        "attachment": [length, 0.0, 0.0],
        "offset_length": 0.0,
        "stiffness": law,
        "damping": {"constant": truth.constant, "slope": truth.slope},
        "drum_radius": RADIUS,
        "rotor_inertia": 2.4e-4,
        "torque_limit": 2.0,
        "tension_limits": [0.0, 60.0],
    }
    return validate(Cable, content | changes, "cable")


def _unstretched(wound: np.ndarray, length: float, stretch: float) -> np.ndarray:
    """The winch takes stretched cable: dl0/dwound = −l0/l."""
    return (length - stretch) * np.exp(-wound / length)


def tension_on(
    truth: SpecimenTruth, wound: np.ndarray, length: float, stretch: float, highest: float
) -> np.ndarray:
    """Return the elastic tension for cable wound in from an elongation `stretch` on."""
    knots = np.linspace(wound.min(), wound.max(), 600)
    unstretched = _unstretched(knots, length, stretch)
    values = truth.elastic(length - unstretched, unstretched, highest)
    return np.interp(wound, knots, values)


def stretch_at(truth: SpecimenTruth, tension: float, length: float) -> float:
    """Return the elongation at a tension, of a cable whose unstretched length is near `length`."""
    grid = np.linspace(0.0, tension, 4001)
    slack = length
    for _ in range(4):
        curve = cumulative_simpson(1.0 / truth.stiffness(grid, slack), x=grid, initial=0.0)
        slack = length - float(curve[-1])
    return length - slack


def dahl(truth: SpecimenTruth, wound: np.ndarray) -> np.ndarray:
    """Return the hysteresis' force: dF = F_c/x_c·(dx − F/F_c·|dx|), from zero on."""
    force, found = 0.0, np.zeros(len(wound))
    stiffness = truth.dahl_force / truth.dahl_scale
    for i, step in enumerate(np.diff(wound)):
        share = force / truth.dahl_force if truth.dahl_force else 0.0
        force += stiffness * (step - share * abs(step))
        found[i + 1] = force
    return found


def noise(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return white noise and as much again with a memory of 50 ms [N]."""
    coloured = lfilter([1.0], [1.0, -0.98], rng.normal(0.0, 0.015 * np.sqrt(1.0 - 0.98**2), count))
    return rng.normal(0.0, 0.015, count) + coloured


def specimen(
    truth: SpecimenTruth,
    length: float,
    wound: np.ndarray,
    tension: np.ndarray,
    rng: np.random.Generator,
    label: str,
) -> Specimen:
    """Return what encoder and load cell show of a motion."""
    time = np.arange(len(wound)) / RATE
    counts = 2.0 * np.pi / 8192
    # Where between two of its steps an encoder rests is chance.
    angle = np.round(wound / RADIUS / counts + rng.uniform(-0.5, 0.5)) * counts
    rate = np.gradient(wound, 1.0 / RATE) + RADIUS * rng.normal(0.0, 0.01, len(wound))
    shown = np.round((tension + noise(rng, len(wound))) / 0.005) * 0.005
    return Specimen(
        label=label,
        recording=Path("nowhere"),
        sha256=SHA,
        cable=described(length, truth, label),
        distance=length,
        time=time,
        wound=RADIUS * (angle - angle[0]),
        rate=rate,
        tension=shown,
    )


def ramps(
    truth: SpecimenTruth,
    length: float,
    *,
    seed: int,
    highest: float = 60.0,
    lowest: float = 0.6,
    ramp: float = 6.0,
    cycles: int = 4,
    label: str | None = None,
) -> Specimen:
    """Return a specimen that was stretched and released slowly between two tensions."""
    rng = np.random.default_rng([seed, round(1000 * length)])
    wound, tension = _pulled(truth, length, highest, lowest, ramp, cycles)
    return specimen(truth, length, wound, tension, rng, label or f"l{round(100 * length)}")


# What noise is drawn for again and again.
@lru_cache(maxsize=16)
def _pulled(
    truth: SpecimenTruth, length: float, highest: float, lowest: float, ramp: float, cycles: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return cable wound in [m] and tension [N], without noise."""
    stretch = stretch_at(truth, lowest, length)
    stroke = stretch_at(truth, highest, length) - stretch
    corners = np.cumsum([0.0, 0.7, ramp, 0.7, ramp])
    times = np.concatenate([k * corners[-1] + corners[:-1] for k in range(cycles)])
    times = np.append(times, cycles * corners[-1] + np.array([0.0, 0.7]))
    heights = np.append(np.tile([0.0, 0.0, stroke, stroke], cycles), [0.0, 0.0])
    time = np.arange(round(times[-1] * RATE)) / RATE
    wound = np.interp(time, times, heights)
    tension = tension_on(truth, wound, length, stretch, 2.0 * highest)
    tension += truth.damping(length) * np.gradient(wound, 1.0 / RATE) + dahl(truth, wound)
    return wound, tension


def multisine(
    truth: SpecimenTruth,
    length: float,
    *,
    seed: int,
    duration: float = 20.0,
    middle: float = 20.0,
    label: str | None = None,
) -> Specimen:
    """Return a specimen whose drum moved by sines up to 10 Hz about a tension."""
    rng = np.random.default_rng([seed, round(1000 * length)])
    stretch = stretch_at(truth, middle, length)
    time = np.arange(round(duration * RATE)) / RATE
    share = 0.25 * middle / float(truth.stiffness(middle, length))
    frequencies = np.array([0.3, 0.9, 1.7, 2.9, 4.3, 6.1, 7.9, 9.7])
    phases = rng.uniform(0.0, 2.0 * np.pi, len(frequencies))
    waves = np.sin(2.0 * np.pi * np.outer(time, frequencies) + phases)
    wound = share * waves @ (1.0 / np.sqrt(len(frequencies) * (1.0 + frequencies / 2.0)))
    unstretched = _unstretched(wound, length, stretch)
    tension = tension_on(truth, wound, length, stretch, 4.0 * middle)
    tension += truth.damping(unstretched) * -np.gradient(unstretched, 1.0 / RATE)
    return specimen(truth, length, wound, tension, rng, label or f"l{round(100 * length)}")
