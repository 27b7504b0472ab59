"""Other ways to read poses: axes, order and sense of quaternions, units, frames."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cspm_checks.machine.poses import ANGLES, Poses, poses

Array = NDArray[np.float64]
Both = tuple[Poses, Poses | None]
Mends = dict[str, dict[str, Any]]
AXES = "xyz"
QUATERNION = ("qx", "qy", "qz", "qw")
UNITS = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048, "m taken for mm": 1e3}


class Reading(NamedTuple):
    """One way to read the same numbers.

    Attributes:
        text: what they would then be.
        remedy: the key that says so, where there is one.
        poses: of bar and winch frame.
        mend: by field: `of` names the field whose source it has, `sign` and `scale` multiply.
    """

    text: str
    remedy: str
    poses: Both
    mend: Mends


def readings(bar: Poses, frame: Poses | None) -> Iterator[Reading]:
    """Yield all other ways to read the poses of bar and winch frame, the simplest first."""
    both = bar, frame
    if bar.angles is None:
        yield from _quaternions(both)
    else:
        yield from _angles(both, bar.angles)
    for matrix in _signed_axes():
        yield from _axes(both, matrix)
    for matrix in _signed_axes():
        yield from _halves(both, matrix)
    yield from _units(both)
    yield from _frames(both)


def _mends(sources: dict[str, tuple[str, float]]) -> Mends:
    """Return what changes: of which field the source is, and whether its sign."""
    found: Mends = {}
    for name, (source, sign) in sources.items():
        keys = ({"of": source} if source != name else {}) | ({"sign": sign} if sign < 0.0 else {})
        found |= {name: keys} if keys else {}
    return found


def _each(both: Both, change: Any) -> Both:  # noqa: ANN401 - a function
    bar, frame = both
    return change(bar), None if frame is None else change(frame)


def _quaternions(both: Both) -> Iterator[Reading]:
    def with_order(order: list[int], signs: list[float]) -> Both:
        return _each(both, lambda p: poses(p.time, p.places, p.turns[:, order] * signs))

    def mend(order: list[int], signs: list[float]) -> Mends:
        return _mends({QUATERNION[i]: (QUATERNION[order[i]], signs[i]) for i in range(4)})

    ones = [1.0] * 4
    text = "the quaternion's columns are in the order w, x, y, z"
    first = [1, 2, 3, 0]
    remedy = "order of the columns: qw is the first"
    yield Reading(text, remedy, with_order(first, ones), mend(first, ones))
    back = [-1.0, -1.0, -1.0, 1.0]
    text = "the quaternion turns the world's axes to the body's (its inverse)"
    remedy = "`sign: -1` for qx, qy, qz"
    yield Reading(text, remedy, with_order([0, 1, 2, 3], back), mend([0, 1, 2, 3], back))
    text = "the quaternion's columns are in the order w, x, y, z, and it is the inverse"
    remedy = "order of the columns: qw is the first; `sign: -1` for qx, qy, qz"
    yield Reading(text, remedy, with_order(first, back), mend(first, back))


def _angles(both: Both, angles: Array) -> Iterator[Reading]:
    def turned(some: Array, order: str = "ZYX") -> Both:
        columns = some[:, ::-1] if order == "ZYX" else some
        turns = Rotation.from_euler(order, columns).as_quat()
        return poses(both[0].time, both[0].places, turns), both[1]

    for unit, some in (("deg", np.radians(angles)), ("rad", np.degrees(angles))):
        mend: Mends = {name: {"unit": unit} for name in ANGLES}
        yield Reading(f"roll, pitch, yaw are in {unit}", f"`unit: {unit}`", turned(some), mend)
    mend = {name: {"sign": -1.0} for name in ANGLES}
    yield Reading("roll, pitch, yaw have the other sign", "`sign: -1`", turned(-angles), mend)
    for i, name in enumerate(ANGLES):
        one = angles * np.where(np.arange(3) == i, -1.0, 1.0)
        mend = {name: {"sign": -1.0}}
        yield Reading(f"{name} has the other sign", "`sign: -1`", turned(one), mend)
    text = "roll, pitch, yaw follow one another in the order x, y, z"
    yield Reading(text, "export quaternions", turned(angles, "XYZ"), {})


def _signed_axes() -> Iterator[Array]:
    """Yield the 47 ways to rename axes and turn them round, fewest changes first."""
    found = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    yield from sorted(found, key=lambda one: float(np.abs(one - np.eye(3)).sum()))[1:]


def _axes(both: Both, matrix: Array) -> Iterator[Reading]:
    """Yield poses of which places and turns are in other axes."""

    def change(one: Poses) -> Poses:
        return poses(one.time, one.places @ matrix.T, _turns_in(one.turns, matrix))

    sources = _sources(matrix)
    side = float(np.round(np.linalg.det(matrix)))
    turns = {f"q{axis}": (f"q{name}", side * sign) for axis, (name, sign) in sources.items()}
    angles = {
        ANGLES[AXES.index(axis)]: (ANGLES[AXES.index(name)], side * sign)
        for axis, (name, sign) in sources.items()
    }
    whole = sources | (turns if both[0].angles is None else angles)
    yield Reading(_axes_text(matrix), _axes_remedy(matrix), _each(both, change), _mends(whole))


def _turns_in(turns: Array, matrix: Array) -> Array:
    """Return the quaternions of S·R·Sᵀ, shape (k, 4)."""
    vector = np.linalg.det(matrix) * turns[:, :3] @ matrix.T
    return np.concatenate([vector, turns[:, 3:]], axis=1)


def _sources(matrix: Array) -> dict[str, tuple[str, float]]:
    """Return for each axis from which one it comes and with which sign."""
    at = np.abs(matrix).argmax(axis=1)
    return {axis: (AXES[at[i]], float(matrix[i, at[i]])) for i, axis in enumerate(AXES)}


def _written(matrix: Array) -> str:
    return ", ".join(f"{'−' if sign < 0 else ''}{name}" for name, sign in _sources(matrix).values())


def _axes_text(matrix: Array) -> str:
    text = f"their axes are others: x, y, z of the world are {_written(matrix)} of the poses"
    down, sign = _sources(matrix)["z"]
    if (down, sign) != ("z", 1.0):
        text += f" ({down} points {'up' if sign < 0 else 'down'})"
    if np.linalg.det(matrix) < 0.0:
        text += ", a left-handed frame"
    return text


def _axes_remedy(matrix: Array) -> str:
    return f"x, y, z from the columns of {_written(matrix)}, and qx, qy, qz likewise"


def _halves(both: Both, matrix: Array) -> Iterator[Reading]:
    """Yield poses of which places or turns alone are in other axes, or all but the body's own."""
    proper = np.linalg.det(matrix) > 0.0
    sources, axes = _sources(matrix), _written(matrix)
    changed = {axis: sources[axis] for axis in AXES if sources[axis] != (axis, 1.0)}
    places = _each(both, lambda p: p._replace(places=p.places @ matrix.T))
    text = f"x, y, z are {axes}, where the orientation is right"
    if len(changed) == 1:
        text = f"{next(iter(changed))} is mirrored"
    yield Reading(text, f"x, y, z from the columns of {axes}", places, _mends(changed))
    turns = _each(both, lambda p: poses(p.time, p.places, _turns_in(p.turns, matrix)))
    text = f"the orientation's axes are {axes}, where x, y, z are right"
    yield Reading(text, f"qx, qy, qz from the columns of {axes}", turns, {})
    if not proper:
        return
    turn = Rotation.from_matrix(matrix)
    body = (poses(both[0].time, both[0].places, (both[0].rotation() * turn).as_quat()), both[1])
    text = f"the body's own axes are others: its x, y, z are {axes}"
    remedy = "attachments in the body's axes of the camera, or the camera's body turned"
    yield Reading(text, remedy, body, {})
    world = _each(
        both,
        lambda p: poses(p.time, p.places @ matrix.T, (turn * p.rotation()).as_quat()),
    )
    text = f"the world is turned: its x, y, z are {axes} of the poses, the body's axes are right"
    yield Reading(text, "the camera's world frame turned", world, {})


def _units(both: Both) -> Iterator[Reading]:
    for name, size in UNITS.items():

        def change(one: Poses, size: float = size) -> Poses:
            return one._replace(places=size * one.places)

        mend: Mends = {axis: {"scale": size} for axis in AXES}
        yield Reading(f"x, y, z are in {name}", "`unit`", _each(both, change), mend)


def _frames(both: Both) -> Iterator[Reading]:
    """Yield poses of the bar as seen from the moving frame, and the two bodies exchanged."""
    bar, frame = both
    if frame is None:
        return
    under = frame.at(bar.time)
    base = under.rotation()
    from_frame = poses(
        bar.time, under.places + base.apply(bar.places), (base * bar.rotation()).as_quat()
    )
    text = "the bar's poses are in the winch frame, not in the world"
    yield Reading(text, "poses in the world's frame", (from_frame, frame), {})
    text = "the poses of bar and winch frame are exchanged"
    swapped = (frame.at(bar.time), bar)
    yield Reading(text, "the other body's columns", swapped, {})
