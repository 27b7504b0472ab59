"""What looks wrong in the numbers of one channel, and how fine they are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_checks.channel import Channel
from cspm_checks.drive_limit import limit_text, limited_share
from cspm_checks.suspicion import Suspicion
from cspm_msgs_py.sensor_spec import MEASURED, quantities
from cspm_msgs_py.testbed import Cable, Testbed
from cspm_msgs_py.topics import Topic

Array = NDArray[np.float64]
COARSE = 64  # levels
LARGEST = {"N·m": np.inf, "N": np.inf, "m": 50.0, "m/s": 20.0, "rad/s": 1000.0}
OVER = 2.0
"""Of a limit: a controller passes it by some percent, a wrong unit by 2.2 at least (lb for kg)."""
MOST_CABLE = 20.0  # m that one winch winds in a recording
_SMALL = 1e-3
_PILE = 5.0
SAMPLE = 20_000
_BODY_ANGLE = 2 * np.pi


def resolution(values: Array) -> float | None:
    """Return the step of which all differences are multiples, None where there is none."""
    levels = np.unique(values[~np.isnan(values)][:SAMPLE])
    steps = np.diff(levels)
    if not len(steps):
        return None
    # Steps of a few units in the last place are round-off, not another level.
    steps = steps[steps > 64 * np.finfo(float).eps * np.abs(levels).max()]
    if len(steps) < 2:
        return None
    step = float(steps.min())
    step = float(np.mean(steps[steps < 1.5 * step]))
    multiples = steps / step
    fits = np.abs(multiples - np.round(multiples)) < 0.02 * np.maximum(multiples, 1.0)
    return step if np.median(multiples) < 10 and fits.mean() > 0.99 else None


def value_suspicions(channel: Channel, values: Array, testbed: Testbed) -> list[Suspicion]:
    """Return what looks wrong in a channel's values, shape (n,) [SI]."""
    values = values[~np.isnan(values)]
    topic, field, where, quantity = channel.topic, channel.field, channel.where, channel.quantity
    if not len(values):
        return [Suspicion(where, "empty", "no number at all")]
    if np.ptp(values) == 0.0:
        if _is_locked(topic, field, testbed):
            return []
        text = f"constant at {values[0]:.6g}{f' {quantity}' if quantity != '1' else ''}"
        return [Suspicion(where, "constant", text, {"value": float(values[0])})]
    found, limit = [], _known_limit(topic, field, testbed)
    if "effort" in field or "velocity" in field:
        found += _saturated(where, quantity, values, limit)
    if text := limit_text(limited_share(values, limit), limit):
        found.append(Suspicion(where, "limit", text, {"share": limited_share(values, limit)}))
    found += _coarse(where, topic, field, quantity, values, testbed)
    return found + _implausible(where, topic, field, quantity, values, testbed)


def _is_locked(topic: Topic, field: str, testbed: Testbed) -> bool:
    """Return whether a channel is of a winch that the test-bed says its brake holds."""
    return topic.name.startswith("/winches/") and cable_of(field, testbed).locked


def cable_of(field: str, testbed: Testbed) -> Cable:
    """Return the cable, with its winch, that a field of a JointState is of."""
    return testbed.cables[testbed.cable_names.index(field.partition("/")[2])]


def _known_limit(topic: Topic, field: str, testbed: Testbed) -> float:
    """Return the torque at which the test-bed's drives hold theirs, infinite for other channels."""
    if not field.startswith("effort/") or not topic.name.startswith("/winches/"):
        return np.inf
    return float(cable_of(field, testbed).torque_limit)


def _saturated(where: str, quantity: str, values: Array, limit: float) -> list[Suspicion]:
    """Return ends of the range at which values pile up, other than a limit of the drive.

    A smooth quantised signal stays 2.4 times as long on its highest level as on the next one.
    """
    levels, counts = np.unique(values, return_counts=True)
    found = []
    for level, count, beside in (
        (levels[-1], counts[-1], counts[-2]),
        (levels[0], counts[0], counts[1]),
    ):
        if abs(abs(level) - limit) <= 0.01 * limit:
            continue
        if count >= 10 and count > _PILE * beside and count > 1e-3 * len(values):
            text = f"{count} values are exactly {level:.6g} {quantity}, the end of its range:"
            text += " saturated?"
            numbers = {"level": float(level), "count": float(count)}
            found.append(Suspicion(where, "saturated", text, numbers))
    return found


def _coarse(
    where: str, topic: Topic, field: str, quantity: str, values: Array, testbed: Testbed
) -> list[Suspicion]:
    step = resolution(values)
    span = float(np.ptp(values))
    found = []
    stated = _stated_resolution(topic, field, testbed)
    # A machine that hardly moves shows few steps of a sensor that is as fine as it should be.
    as_stated = bool(step and stated and 0.5 <= step / stated <= 2.0)
    if step and span / step < COARSE and not as_stated:
        text = f"only {round(span / step) + 1} levels, {step:.6g} {quantity} apart"
        found.append(Suspicion(where, "coarse", text, {"resolution": step, "range": span}))
    if not stated:
        return found
    if step and not 0.5 <= step / stated <= 2.0:
        text = f"resolution {step:.4g} {quantity}, the test-bed says {stated:.4g}"
        text += f": factor {step / stated:.4g}"
        found.append(Suspicion(where, "resolution", text, {"found": step, "stated": stated}))
    steps = (values[:SAMPLE] - values[0]) / stated
    if not step and np.mean(np.abs(steps - np.round(steps)) > 0.1) > 0.5:
        text = f"on no grid, where the test-bed's resolution is {stated:.4g} {quantity}:"
        text += " filtered or resampled before?"
        found.append(Suspicion(where, "smoothed", text, {"stated": stated}))
    return found


def _stated_resolution(topic: Topic, field: str, testbed: Testbed) -> float | None:
    sensor = testbed.sensors.get(topic.name)
    if sensor is None or topic.name not in MEASURED:
        return None
    if len(quantities(testbed.topics[topic.name])) == 1:
        return sensor.resolution[0]
    part = field.partition("/")[0]
    if part in ("position", "velocity", "effort"):
        return sensor.resolution[("position", "velocity", "effort").index(part)]
    return sensor.resolution[0] if field in ("x", "y", "z", "vx", "vy", "vz") else None


def _implausible(
    where: str, topic: Topic, field: str, quantity: str, values: Array, testbed: Testbed
) -> list[Suspicion]:
    found = []

    def add(text: str, **numbers: Any) -> None:  # noqa: ANN401 - numbers
        found.append(Suspicion(where, "implausible", text, numbers))

    largest = float(np.abs(values).max())
    limit = LARGEST.get(quantity, np.inf)
    if field in ("roll", "pitch", "yaw"):
        limit = _BODY_ANGLE
    if largest > limit:
        add(f"up to {largest:.6g} {quantity}, more than {limit:.4g}: unit?", largest=largest)
    if "/" not in field:
        return found
    cable = cable_of(field, testbed)
    if quantity == "N·m":
        _against_limit(add, largest, cable.torque_limit, quantity, "torque limit")
    if quantity == "N" and cable.tension_limits:
        _against_limit(add, largest, cable.tension_limits[1], quantity, "tension limit")
        low = float(np.quantile(values, 0.01))
        if low < -0.01 * cable.tension_limits[1]:
            add(f"a cable that pushes with {-low:.6g} N: sign or zero?", lowest=low)
    wound = float(np.ptp(values)) * cable.drum_radius / cable.gear_ratio
    if quantity == "rad" and cable.has_cable and wound > MOST_CABLE:
        add(f"winds {wound:.4g} m of cable: unit or counts per turn?", wound=wound)
    return found


def _against_limit(add: Any, largest: float, limit: float, quantity: str, name: str) -> None:  # noqa: ANN401 - a function
    if largest > OVER * limit:
        add(
            f"up to {largest:.6g} {quantity}, the {name} is {limit:g}: unit?",
            largest=largest,
            limit=limit,
        )
    elif largest < _SMALL * limit:
        add(
            f"never above {largest:.4g} {quantity}, the {name} is {limit:g}: unit?",
            largest=largest,
            limit=limit,
        )


def quaternion_suspicions(topic: str, rows: Array) -> list[Suspicion]:
    """Return whether quaternions, shape (n, 4), are not of unit length."""
    off = np.abs(np.linalg.norm(rows, axis=1) - 1.0)
    worst = float(np.nanmax(off))
    if worst <= 1e-3:
        return []
    text = f"quaternions up to {worst:.3g} longer or shorter than 1: order, unit, or rounded?"
    return [Suspicion(topic, "quaternion", text, {"worst": worst})]
