"""Where the cables of a new robot run, by its kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

Vector = tuple[float, float, float]

# The platform's half width as a share of the frame's least side, and where it hangs in the frame.
PLATFORM, DEPTH = 0.075, 0.6
# How far the two winches of a corner of an eight-cable robot are apart, as a share of its side.
CORNER_GAP = 0.05
# A frame whose sides differ by less than this counts as square; there a platform that cables turn
# is narrower than long.
SQUARE, NARROW = 0.7, 0.4


class Line(NamedTuple):
    """One cable: name, exit in world_ned [m], attachment in bar_ned [m]."""

    name: str
    exit: Vector
    attachment: Vector


class Layout(NamedTuple):
    """A robot's cables, where its platform is at rest, and in which plane it moves.

    Attributes:
        lines: the cables.
        heave: of the mean pose, z down from the ceiling of the frame [m].
        half: half the platform's width [m].
        upright: whether it moves in the plane of surge and heave only.
    """

    lines: tuple[Line, ...]
    heave: float
    half: float
    upright: bool = False


def layout(kind: str, size: Vector) -> Layout:
    """Return the cables of a robot of a kind, one of `KINDS`, in a frame of `size` x y z [m]."""
    return KINDS[kind](size)


def _corners(size: Vector, heave: float) -> dict[str, Vector]:
    x, y = 0.5 * size[0], 0.5 * size[1]
    return {
        "front_left": (x, -y, heave),
        "front_right": (x, y, heave),
        "rear_right": (-x, y, heave),
        "rear_left": (-x, -y, heave),
    }


def _plate(corner: Vector, half: float, narrow: float = 1.0) -> Vector:
    across = narrow * half
    return (half if corner[0] > 0 else -half, across if corner[1] > 0 else -across, 0.0)


def _planar(size: Vector) -> Layout:
    x, half = 0.5 * size[0], 2.0 * PLATFORM * min(size[0], size[2])
    lines = tuple(
        Line(f"{level}_{side}", (sign * x, 0.0, z), (sign * half, 0.0, 0.0))
        for level, z in (("upper", 0.0), ("lower", size[2]))
        for side, sign in (("front", 1.0), ("rear", -1.0))
    )
    return Layout(lines, 0.5 * size[2], half, upright=True)


def _point(size: Vector) -> Layout:
    lines = tuple(Line(name, exit_, (0.0, 0.0, 0.0)) for name, exit_ in _corners(size, 0.0).items())
    return Layout(lines, DEPTH * size[2], PLATFORM * min(size))


def _suspended(size: Vector) -> Layout:
    half = PLATFORM * min(size)
    lines = tuple(Line(n, e, _plate(e, half)) for n, e in _corners(size, 0.0).items())
    return Layout(lines, DEPTH * size[2], half)


def _crossed(size: Vector) -> Layout:
    """Two winches per corner, whose cables cross to the top and the foot of a cube."""
    half, lines = PLATFORM * min(size), []
    near = 1.0 - CORNER_GAP
    for name, (x, y, _) in _corners(size, 0.0).items():
        along, across = (1.0 if x > 0 else -1.0), (1.0 if y > 0 else -1.0)
        foot = (along * half, -across * half, half)
        top = (-along * half, across * half, -half)
        lines += [
            Line(f"{name}_foot", (x, near * y, 0.0), foot),
            Line(f"{name}_top", (near * x, y, 0.0), top),
        ]
    return Layout(tuple(lines), DEPTH * size[2], half)


def _held(size: Vector) -> Layout:
    """Return eight cables whose platform is narrow in a frame that is not.

    Where both have one shape all cables meet the middle's vertical, and none turns the platform.
    """
    half = PLATFORM * min(size)
    narrow = NARROW if size[1] > SQUARE * size[0] else 1.0
    lines = tuple(
        Line(f"{level}_{name}", exit_, _plate(exit_, half, narrow))
        for level, z in (("upper", 0.0), ("lower", size[2]))
        for name, exit_ in _corners(size, z).items()
    )
    return Layout(lines, 0.5 * size[2], half)


KINDS: dict[str, Callable[[Vector], Layout]] = {
    "planar": _planar,
    "point": _point,
    "suspended": _suspended,
    "crossed": _crossed,
    "held": _held,
}
