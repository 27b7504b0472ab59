"""Whether the numbers of a topic are finite and change as those of a live sensor do."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.sensor_spec import quantities
from cspm_msgs_py.testbed import Testbed
from cspm_ros.check_drivers.driver_observation import Array, Finding, Heard

LARGEST = 1e12
STILL_TIME = 0.5  # s
NEW_SHARE = 0.6

Flags = NDArray[np.bool_]


def check_finite(heard: Heard) -> Finding:
    """Look for NaN, infinite and absurd numbers in what every message carries."""
    bad = ~(np.abs(heard.values[:, heard.present]) <= LARGEST)
    if not bad.any():
        return Finding(heard.topic.name, "finite", True, "all numbers finite")
    where = ", ".join(np.array(heard.topic.fields)[heard.present][bad.any(axis=0)])
    count = f"{int(bad.any(axis=1).sum())} of {len(bad)} messages"
    text = f"{where}: NaN, infinite or beyond {LARGEST:g} in {count}"
    return Finding(heard.topic.name, "finite", False, text)


def check_change(heard: Heard, testbed: Testbed) -> list[Finding]:
    """Warn of numbers that stand still although, by the test-bed, their sensor has noise.

    At least two messages, all numbers finite.
    """
    name = heard.topic.name
    warnings = list(_frozen(heard, testbed)) or list(_repeated(heard))
    return [Finding(name, "changes", None, text) for text in warnings] or [
        Finding(name, "changes", True, "the numbers change")
    ]


def _frozen(heard: Heard, testbed: Testbed) -> Iterator[str]:
    still = (heard.values == heard.values[0]).all(axis=0)
    if still[heard.present].all():
        yield "does not change: is the sensor on?"
        return
    frozen = still & heard.present & _noisy(heard, testbed)
    if frozen.any():
        where = ", ".join(np.array(heard.topic.fields)[frozen])
        yield f"{where} does not change: is the sensor on?"


def _noisy(heard: Heard, testbed: Testbed) -> Flags:
    """Return the columns (width,) in which noise must show; without a description, all."""
    topic = heard.topic
    sensor = testbed.sensors.get(topic.name)
    noise = np.array(sensor.noise if sensor else np.ones(len(quantities(topic))))
    if topic.name.endswith("/pose"):
        # w stays 1 to many digits however much an upright body trembles.
        return np.array([noise[0] > 0.0] * 3 + [False] * 4)
    return np.repeat(noise > 0.0, topic.width // len(noise))


def _repeated(heard: Heard) -> Iterator[str]:
    same = (np.diff(heard.values[:, heard.present], axis=0) == 0.0).all(axis=1)
    longest = _longest_run(same, heard.value_times)
    fresh = 1.0 - float(np.mean(same))
    if longest > STILL_TIME:
        yield f"the same numbers for {longest:.2f} s: is tracking lost, or does the sensor hang?"
    elif fresh <= NEW_SHARE:
        yield f"only {fresh:.0%} of the messages bring new numbers: is a slower sensor repeated?"


def _longest_run(same: Flags, times: Array) -> float:
    """Return the longest time [s] over which rows repeat; `same` (n − 1,), `times` (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]
    return float(np.max(times[ends] - times[starts], initial=0.0))
