"""What the nodes of a recorded run reported about themselves on `/diagnostics`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from cspm_msgs_py.diagnostics import Level, Status, decode_diagnostics
from cspm_msgs_py.recording.reader import Recording
from cspm_msgs_py.stepping.delay_histogram import DelayHistogram
from cspm_msgs_py.topics import DIAGNOSTICS

# Totals since the start: the last counts. Largest since the last message: the largest counts.
TOTALS = ("deadlines_missed", "late_steps", "stale_inputs", "refused", "lost")
LARGEST = ("worst_latency_ms",)
_DELAYS = "torque_delays"


def first_alarm(path: Path) -> str | None:
    """Return the first error that a node reported, with its name, if one did.

    Raises:
        InputError: the recording cannot be read.
    """
    for status in _statuses(path):
        if status.level == Level.ERROR:
            return f"{status.name}: {status.message}"
    return None


def timing_of(path: Path) -> dict[str, dict[str, float]]:
    """Return by node what it reported of deadlines, stale and unusable inputs, and losses.

    Raises:
        InputError: the recording cannot be read.
    """
    found: dict[str, dict[str, float]] = {}
    for status in _statuses(path):
        for key, text in status.values.items():
            if key in TOTALS:
                found.setdefault(status.name, {})[key] = int(text)
            elif key in LARGEST:
                reported = found.setdefault(status.name, {})
                reported[key] = max(reported.get(key, 0.0), float(text))
    return found


def torque_delays(path: Path) -> DelayHistogram | None:
    """Return how late torque commands came to the plant, None where it did not report it.

    Raises:
        InputError: the recording cannot be read.
    """
    found = [s.values[_DELAYS] for s in _statuses(path) if _DELAYS in s.values]
    return DelayHistogram.from_text(found[-1]) if found else None


def _statuses(path: Path) -> Iterator[Status]:
    with Recording(path) as recording:
        if recording.topics[DIAGNOSTICS.name].count:
            for payload in recording.payloads(DIAGNOSTICS.name).payloads:
                yield from decode_diagnostics(payload).statuses
