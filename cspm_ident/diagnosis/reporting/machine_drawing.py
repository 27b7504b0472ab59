"""A drawing of a test-bed from its geometry, some of its parts marked."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from cspm_ident.diagnosis.reporting.machine_part import Kind, Part
from cspm_model.kinematics import rotation
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]
Point = tuple[float, float]
Placed = Callable[[Array], Point]

_WIDTH, _HEIGHT, _EDGE = 480.0, 460.0, 36.0
# Beside the machine, for names, and from one name to the next.
_NAMES, _LINE = 250.0, 26.0
# Oblique: depth y runs up and to the right at half its length.
_DEPTH = np.array([0.40, -0.30])
# Distance of winches without a cable, which have no position and are drawn in a row [m].
_APART_M = 0.5
# Of a drawn cable's length: where its load cell is.
_CELL_SHARE = 0.15
_PLAIN, _MARKED = "#667", "#c62828"
_EDGES = (
    (0, 1),
    (1, 3),
    (3, 2),
    (2, 0),
    (4, 5),
    (5, 7),
    (7, 6),
    (6, 4),
    (0, 4),
    (1, 5),
    (2, 6),
    (3, 7),
)


def drawing(
    machine: Testbed, bar_pose: Array | None, frame_pose: Array | None, marked: Collection[Part]
) -> str:
    """Return an SVG of the machine seen from the side, z down, with marked parts in red and named.

    Args:
        machine: whose geometry to draw.
        bar_pose: x y z φ θ ψ in world_ned [m, rad]; None draws cables to where they are fixed.
        frame_pose: likewise of the winch frame; None: at the world's origin.
        marked: the parts to point at.
    """
    bodies = _bodies(machine, bar_pose, frame_pose)
    ends = _ends(machine, bar_pose, frame_pose)
    corners = [point for _, box in bodies for point in box]
    place, (right, foot) = _placing(np.array([*corners, *(end for pair in ends for end in pair)]))
    shapes: list[tuple[Part, str, Point]] = []
    for name, box in bodies:
        shapes += _body(name, [place(corner) for corner in box], Part(Kind.BODY, name) in marked)
    for cable, (top, bottom) in zip(machine.cables, ends, strict=True):
        shapes += _cable(cable.name, place(top), place(bottom), cable.has_cable, marked)
    label = "test-bed" + "".join(f", {part.words} marked" for part in marked)
    names, lowest = _names(shapes, marked, right + 0.7 * _EDGE)
    width = max(_WIDTH, right + _NAMES) if names else _WIDTH
    return (
        f'<svg viewBox="0 0 {width:.0f} {max(foot + _EDGE, lowest):.0f}" role=img'
        f' aria-label="{escape(label)}" style="width:100%;max-width:600px;height:auto">'
        f"{''.join(_grouped(part, shape, part in marked) for part, shape, _ in shapes)}"
        f"{names}</svg>"
    )


def _bodies(
    machine: Testbed, bar_pose: Array | None, frame_pose: Array | None
) -> list[tuple[str, list[Array]]]:
    found = []
    frame = machine.winch_frame
    if frame is not None and frame.dimensions is not None:
        found.append(("winch_frame", _box(frame.dimensions, frame_pose)))
    if machine.bar is not None and bar_pose is not None:
        found.append(("bar", _box(machine.bar.dimensions, bar_pose)))
    return found


def _box(dimensions: Sequence[float], pose: Array | None) -> list[Array]:
    half = 0.5 * np.array(dimensions)
    signs = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1), indexing="ij")).reshape(3, -1).T
    return [_at(half * sign, pose) for sign in signs]


def _at(point: Iterable[float], pose: Array | None) -> Array:
    there = np.array(list(point), dtype=float)
    return there if pose is None else np.asarray(pose[:3] + rotation(pose) @ there)


def _ends(
    machine: Testbed, bar_pose: Array | None, frame_pose: Array | None
) -> list[tuple[Array, Array]]:
    found = []
    for i, cable in enumerate(machine.cables):
        if cable.exit is None or cable.attachment is None:
            there = np.array([_APART_M * i, 0.0, 0.0])
            found.append((there, there))
        else:
            held = bar_pose if machine.bar is not None else None
            found.append((_at(cable.exit, frame_pose), _at(cable.attachment, held)))
    return found


def _placing(points: Array) -> tuple[Placed, Point]:
    """Return the map from world [m] to picture [px], and the picture's lower right corner.

    The scale fits the machine into the picture; a flat machine gets a lower picture.
    """
    flat = np.array([_flat(point) for point in points])
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    room = np.array([_WIDTH, _HEIGHT]) - 2.0 * _EDGE
    scale = float(np.min(room / np.maximum(size, 1e-6)))
    shift = np.array([_EDGE, _EDGE])

    def place(point: Array) -> Point:
        x, y = shift + scale * (_flat(point) - low)
        return float(x), float(y)

    right, bottom = shift + scale * size
    return place, (float(right), float(bottom))


def _flat(point: Array) -> Array:
    return np.asarray(np.array([point[0], point[2]]) + _DEPTH * point[1])


def _body(name: str, corners: Sequence[Point], marked: bool) -> list[tuple[Part, str, Point]]:
    width, colour = (3.0, _MARKED) if marked else (1.2, _PLAIN)
    lines = "".join(_line(corners[a], corners[b], colour, width) for a, b in _EDGES)
    middle = np.mean(corners, axis=0)
    x, y = float(middle[0]), float(middle[1])
    markers = "".join(f'<circle cx="{x + d:.1f}" cy="{y:.1f}" r="4"/>' for d in (-12.0, 0.0, 12.0))
    return [(Part(Kind.BODY, name), lines, (x, y)), (Part(Kind.MARKERS, name), markers, (x, y))]


def _cable(
    name: str, top: Point, bottom: Point, has_cable: bool, marked: Collection[Part]
) -> list[tuple[Part, str, Point]]:
    winch, cable, cell = (Part(k, name) for k in (Kind.WINCH, Kind.CABLE, Kind.LOAD_CELL))
    found = []
    if has_cable:
        width, colour = (4.0, _MARKED) if cable in marked else (1.5, _PLAIN)
        found.append((cable, _line(top, bottom, colour, width), _between(top, bottom, 0.5)))
        x, y = _between(top, bottom, _CELL_SHARE)
        square = f'<rect x="{x - 5:.1f}" y="{y - 5:.1f}" width="10" height="10"/>'
        found.append((cell, square, (x, y)))
    drum = f'<circle cx="{top[0]:.1f}" cy="{top[1]:.1f}" r="8"/>'
    return [*found, (winch, drum, top)]


def _between(one: Point, other: Point, share: float) -> Point:
    return one[0] + share * (other[0] - one[0]), one[1] + share * (other[1] - one[1])


def _line(one: Point, other: Point, colour: str, width: float) -> str:
    return (
        f'<line x1="{one[0]:.1f}" y1="{one[1]:.1f}" x2="{other[0]:.1f}" y2="{other[1]:.1f}"'
        f' stroke="{colour}" stroke-width="{width:g}"/>'
    )


def _grouped(part: Part, shape: str, marked: bool) -> str:
    fill = _MARKED if marked else "#dde"
    kind = " class=guilty" if marked else ""
    line = f'stroke="{_MARKED if marked else _PLAIN}" stroke-width="{3 if marked else 1}"'
    return f'<g{kind} fill="{fill}" {line}><title>{escape(part.words)}</title>{shape}</g>'


def _names(
    shapes: Sequence[tuple[Part, str, Point]], marked: Collection[Part], beside: float
) -> tuple[str, float]:
    """Return the marked parts' names in a column beside the machine, and where it ends [px].

    A line connects each name with its part; names do not overlap each other or the machine.
    """
    own = [(part, place) for part, _, place in shapes if part in marked]
    found, below = "", _EDGE
    for part, (x, y) in sorted(own, key=lambda each: each[1][1]):
        below = max(below, y + 7.0)
        found += (
            f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{beside - 5.0:.1f}" y2="{below - 7.0:.1f}"'
            f' stroke="{_MARKED}" stroke-width="1" stroke-dasharray="4 3"/>'
            f'<text x="{beside:.1f}" y="{below:.1f}" font-size="20" font-weight="bold"'
            f' fill="{_MARKED}">{escape(part.words)}</text>'
        )
        below += _LINE
    return found, below
