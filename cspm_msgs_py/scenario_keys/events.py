"""The key `events:` of a scenario: what happens to the machine during a run."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import NonNegativeFloat

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.yaml_file import StrictModel


class CableCut(StrictModel):
    """A cable that parts.

    Attributes:
        at: the instant from which it carries nothing [s], a whole number of the plant's periods.
        cut: the cable's name.
    """

    at: NonNegativeFloat
    cut: str


def check_times(events: Sequence[CableCut], duration: float, plant_rate: int) -> None:
    """Check that events lie within a run of `duration` [s], on the steps of its plant [Hz].

    Raises:
        ValueError: naming the event and what is allowed.
    """
    for i, event in enumerate(events):
        if event.at >= duration:
            raise ValueError(
                f"events[{i}].at: {event.at:g} s, allowed: before the run's end at {duration:g} s"
            )
        steps = event.at * plant_rate
        if abs(steps - round(steps)) > 1e-6 * max(1.0, steps):
            raise ValueError(
                f"events[{i}].at: {event.at:g} s, allowed: a whole number of the plant's periods"
                f" of 1/{plant_rate} s"
            )
        if event.cut in [earlier.cut for earlier in events[:i]]:
            raise ValueError(f"events[{i}].cut: {event.cut} is cut twice, allowed: once")


def check_cables(events: Sequence[CableCut], testbed: Testbed) -> None:
    """Check that a test-bed has the cables that part.

    Raises:
        InputError: naming the event and what is allowed.
    """
    names = [cable.name for cable in testbed.cables if cable.has_cable]
    for i, event in enumerate(events):
        if event.cut not in names:
            raise InputError(f"events[{i}].cut: {event.cut}, allowed: {', '.join(names)}")


def cuts_by_step(
    events: Sequence[CableCut], names: Sequence[str], period_ns: int
) -> dict[int, list[int]]:
    """Return which cables part, by index in `names`, at which steps of `period_ns` [ns]."""
    found: dict[int, list[int]] = {}
    for event in events:
        step = round(event.at * 1e9 / period_ns)
        found.setdefault(step, []).append(names.index(event.cut))
    return found
