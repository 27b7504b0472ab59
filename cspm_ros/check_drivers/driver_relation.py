"""How one measured signal follows from another: by which factor, and what that factor means."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from cspm_model.robust_statistics import difference_noise
from cspm_ros.check_drivers.driver_observation import Array, Finding

FACTOR_TOLERANCE = 0.1
LEAST_CORRELATION = 0.9
SHORTEST_BLOCK = 0.05  # s
BLOCK_SAMPLES = 5
FEWEST_BLOCKS = 5
CLEAR, SURELY_CLEAR = 5.0, 10.0  # of the noise

DEGREES = 180.0 / np.pi
ANGLE_UNITS = {DEGREES: "in degrees"}
SPEED_UNITS = {
    DEGREES: "in degrees per second",
    30.0 / np.pi: "in revolutions per minute",
    0.5 / np.pi: "in revolutions per second",
    1.0 / DEGREES: "with the angle in degrees",
}
LENGTH_UNITS = {1000.0: "in millimetres", 100.0: "in centimetres"}
TENSION_UNITS = {
    1e3 / 9.80665: "in grams",
    1.0 / 9.80665: "in kilograms",
    1000.0: "in millinewtons",
    0.001: "in kilonewtons",
    1.0 / 4.448222: "in pounds",
}
TORQUE_UNITS = {1000.0: "in millinewton metres", 100.0: "in newton centimetres"}
# Of a torque held against a tension of which nothing else shows the unit.
HELD_UNITS = {
    9.80665e-3: "with the tension in grams",
    9.80665: "with the tension in kilograms",
    0.001: "with the tension in millinewtons",
}

# Whether something is as it must be, None where the numbers cannot decide, and why.
Verdict = tuple[bool | None, str]


class Series(NamedTuple):
    """One number over time: times (n,) [s], increasing, and values (n,)."""

    times: Array
    values: Array

    @property
    def noise(self) -> float:
        """Standard deviation of what is white in it, from third differences, and half a step."""
        if len(self.values) < 4:
            return float("inf")
        white = difference_noise(self.values)
        steps = np.abs(np.diff(self.values))
        quantum = float(np.min(steps[steps > 0])) if (steps > 0).any() else 0.0
        return float(white) + 0.5 * quantum

    @property
    def spacing(self) -> float:
        """Median time between two values [s]."""
        return float(np.median(np.diff(self.times)))


class Relation(NamedTuple):
    """How two signals relate.

    Attributes:
        factor: second over first, negative if they run against each other.
        correlation: −1 to 1.
        clear: whether both are well above their noise.
        swamped: whether neither is well above both noises.
    """

    factor: float
    correlation: float
    clear: bool
    swamped: bool


_UNRELATED = Relation(float("nan"), 0.0, clear=False, swamped=True)


def rate_relation(value: Series, rate: Series) -> Relation:
    """Return how `rate` relates to the derivative of `value`.

    Compared are changes and integrals over blocks, so that noise is not differentiated.
    """
    edges = _edges(value, rate)
    if len(edges) <= FEWEST_BLOCKS:
        return _UNRELATED
    areas = 0.5 * (rate.values[1:] + rate.values[:-1]) * np.diff(rate.times)
    integral = np.concatenate([[0.0], np.cumsum(areas)])
    change = np.diff(np.interp(edges, value.times, value.values))
    expected = np.diff(np.interp(edges, rate.times, integral))
    noise = rate.noise * np.sqrt((edges[1] - edges[0]) * rate.spacing)
    return relate(change, expected, np.sqrt(2.0) * value.noise, noise)


def value_relation(first: Series, second: Series, floor: float) -> Relation:
    """Return how `second` relates to `first`, but for constants; `floor` is the least noise."""
    edges = _edges(first, second)
    if len(edges) <= FEWEST_BLOCKS:
        return _UNRELATED
    a = np.interp(edges, first.times, first.values)
    b = np.interp(edges, second.times, second.values)
    return relate(a - a.mean(), b - b.mean(), max(first.noise, floor), max(second.noise, floor))


def _edges(first: Series, second: Series) -> Array:
    start, end = max(first.times[0], second.times[0]), min(first.times[-1], second.times[-1])
    block = max(SHORTEST_BLOCK, BLOCK_SAMPLES * max(first.spacing, second.spacing))
    return np.arange(start, end, block)


def relate(a: Array, b: Array, noise_a: float, noise_b: float) -> Relation:
    """Return how `b` relates to `a`, (n,) each, with the noise of one value of each."""
    size_a, size_b = float(np.sqrt(np.mean(a**2))), float(np.sqrt(np.mean(b**2)))
    if size_a == 0.0 or size_b == 0.0:
        swamped = max(size_a, size_b) <= SURELY_CLEAR * max(noise_a, noise_b)
        return _UNRELATED._replace(swamped=swamped)
    product = float(np.mean(a * b))
    return Relation(
        factor=float(np.copysign(size_b / size_a, product)),
        correlation=product / (size_a * size_b),
        clear=size_a > CLEAR * noise_a and size_b > CLEAR * noise_b,
        swamped=max(size_a, size_b) <= SURELY_CLEAR * max(noise_a, noise_b),
    )


def verdict_on(
    relation: Relation,
    units: Mapping[float, str],
    what: str,
    hint: str = "",
    tolerance: float = FACTOR_TOLERANCE,
) -> Verdict:
    """Judge a relation whose factor must be 1.

    Args:
        relation: as found.
        units: see `factor_fault`.
        what: what the second signal is if all is well.
        hint: what may be the cause if both are unrelated.
        tolerance: by how much the factor may be off.
    """
    if not relation.clear and relation.swamped:
        return None, f"cannot decide whether it is {what}: it hardly moves"
    if abs(relation.correlation) < LEAST_CORRELATION:
        return False, f"is not {what}{hint}"
    fault = factor_fault(relation.factor, units, tolerance)
    return not fault, f"is {what}, but {fault}" if fault else f"is {what}"


def factor_fault(
    factor: float, units: Mapping[float, str], tolerance: float = FACTOR_TOLERANCE
) -> str:
    """Return what makes a factor differ from 1 in words, empty if it does not.

    Args:
        factor: found over expected.
        units: phrases such as "in degrees" by the factor that they mean.
        tolerance: by how much a factor may be off.
    """
    name = factor_name(factor, units, tolerance)
    return f"times {factor:.3g}" if name is None else name


def factor_name(factor: float, units: Mapping[float, str], tolerance: float) -> str | None:
    """Return what a factor means, empty for 1 and None where nothing is known of it."""
    signs = ["its sign inverted"] if factor < 0.0 else []
    for known, phrase in {1.0: "", **units}.items():
        if abs(abs(factor) / known - 1.0) <= tolerance:
            return ", ".join([phrase] * bool(phrase) + signs)
    return None


def grouped(topic: str, check: str, verdicts: Mapping[str, Verdict]) -> list[Finding]:
    """Return one finding for all joints with the same verdict, naming them."""
    joints: dict[Verdict, list[str]] = {}
    for joint, verdict in verdicts.items():
        joints.setdefault(verdict, []).append(joint)
    everyone = len(joints) == 1 and len(verdicts) > 1
    return [
        Finding(topic, check, ok, f"{'all' if everyone else ', '.join(names)}: {text}")
        for (ok, text), names in joints.items()
    ]
