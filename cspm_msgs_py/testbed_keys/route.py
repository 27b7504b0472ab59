"""The way of a cable over points and pulleys, from its winch to its dead end."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from cspm_msgs_py.testbed_keys.plausible import DrumRadius, Point
from cspm_msgs_py.testbed_keys.pulley import Axis, Pulley
from cspm_msgs_py.yaml_file import StrictModel

# The exit, and behind it as many stops as the kernels have room for.
MOST_STOPS = 17


class Stop(StrictModel):
    """Where a cable touches the winch frame or the bar: a point, or a pulley around `at`.

    Attributes:
        on: the body; without winch frame, or bar, the world.
        at: in the axes of that body [m].
        radius: of a pulley, which swivels freely about its centre [m]; None: a point.
        axis: of a pulley at the exit alone, as `Pulley.axis`; the cable enters it at `at`.
    """

    on: Literal["frame", "bar"]
    at: Point
    radius: DrumRadius | None = None
    axis: Axis | None = None


Route = Annotated[tuple[Stop, ...], Field(min_length=2, max_length=MOST_STOPS)]


def check_route(route: Sequence[Stop], name: str) -> None:
    """Refuse what is no way of a cable from the winch frame to the bar.

    Raises:
        ValueError: naming stop and what is allowed.
    """
    if route[0].on != "frame":
        raise ValueError(f"route[0].on: bar, of {name}, allowed: frame, where its winch is")
    if all(stop.on == "frame" for stop in route):
        raise ValueError(f"route: of {name}, on the frame alone, allowed: at least one stop on bar")
    if route[-1].radius is not None:
        raise ValueError(
            f"route[{len(route) - 1}].radius: {route[-1].radius:g} m of {name}, allowed: none at"
            " its dead end, which is a point"
        )
    for k, stop in enumerate(route):
        if stop.axis is not None and (k > 0 or stop.radius is None):
            raise ValueError(f"route[{k}].axis: of {name}, allowed: of a pulley at the exit alone")
    if route[0].radius is not None and route[0].axis is None:
        raise ValueError(
            f"route[0].axis: missing for {name}, allowed: the direction in which the cable enters"
            " the pulley at its exit"
        )
    for k, (one, other) in enumerate(pairwise(route), start=1):
        # The pulley at the exit lies beside that point.
        radii = ((one.radius or 0.0) if k > 1 else 0.0) + (other.radius or 0.0)
        apart = float(np.linalg.norm(np.subtract(one.at, other.at)))
        if one.on == other.on and apart <= radii:
            raise ValueError(
                f"route[{k}].at: {list(other.at)} of {name}, {apart:.4g} m from the stop before it,"
                f" allowed: more than the radii together, {radii:g} m"
            )


def exit_pulley(route: Sequence[Stop]) -> Pulley | None:
    """Return the pulley at a route's exit."""
    first = route[0]
    if first.radius is None or first.axis is None:
        return None
    return Pulley(radius=first.radius, axis=first.axis)


def moved_ends(
    route: Sequence[Stop], leaves: object | None, attachment: object | None
) -> tuple[dict[str, object], ...]:
    """Return a route as plain data, with another exit or first stop on the bar where given."""
    stops = [stop.model_dump() for stop in route]
    for k, place in ((0, leaves), (first_on_bar(route), attachment)):
        if place is not None:
            stops[k]["at"] = place
    return tuple(stops)


def first_on_bar(route: Sequence[Stop]) -> int:
    """Return which stop is the first on the bar."""
    return next(k for k, stop in enumerate(route) if stop.on == "bar")
