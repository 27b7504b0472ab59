"""Whether poses and encoders tell of the same motion, and if not, which reading of them does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from cspm_checks.machine.coarse_lateness import CoarseShift, coarse_shift
from cspm_checks.machine.encoder_order import encoder_faults, late_reversals
from cspm_checks.machine.misfit import Winding, scatter
from cspm_checks.machine.pose_readings import Reading, readings
from cspm_checks.machine.poses import BAR, FRAME, Poses, poses
from cspm_checks.suspicion import Suspicion

Array = NDArray[np.float64]
ROWS = 400
"""Instants that are enough to tell readings apart."""
BETTER = 0.4
"""Of what is left as it is: another reading has to leave less."""
NEAR = 1.5
"""Times the least that a reading leaves: what leaves no more is as likely."""
SHOWN = 3
FEW_ENCODERS = 2
"""That many encoders are likelier wrong than the poses; more of them the other way round."""


def kinematic_suspicions(whole: Winding) -> list[Suspicion]:
    """Return how poses and encoders contradict each other, and what brings them together.

    Args:
        whole: what both say of the cables.
    """
    few = _some(whole)
    hangs = few.hangs(few.bar, few.frame)
    if not whole.wrong.any() and hangs:
        return late_reversals(whole)
    if pose_shift(whole):
        return []
    encoders = encoder_faults(whole) if hangs else None
    fitting = _fitting(few)
    if encoders is not None:
        better = [at for _, at in fitting if NEAR * at < _mean(encoders.left)]
        if encoders.changed <= FEW_ENCODERS or not fitting:
            return encoders.suspicions if not better else [_otherwise(whole, fitting)]
    if fitting:
        return [_otherwise(whole, fitting)]
    return [_moved_frame(few) or _unexplained(whole)] if whole.wrong.any() else []


def pose_shift(one: Winding) -> CoarseShift | None:
    """Return by how much poses are late against encoders that contradict them, where that is it."""
    if not one.wrong.any():
        return None
    found = coarse_shift(one.bar.time, one.lengths, one.bar.time, one.wound)
    return found if found and abs(found.seconds) > 2.0 * found.step else None


def _some(one: Winding) -> Winding:
    """Return a few hundred instants of all."""
    places = np.flatnonzero(np.isfinite(one.lengths).all(axis=1))
    chosen = places[:: max(len(places) // ROWS, 1)]
    frame = None if one.frame is None else one.frame.at(one.bar.time[chosen])
    return one._replace(
        bar=one.bar.some(chosen),
        frame=frame,
        lengths=one.lengths[chosen],
        wound=one.wound[chosen],
    )


def _fitting(one: Winding) -> list[tuple[Reading, float]]:
    """Return the readings that fit all encoders and what each leaves [m], the simplest first."""
    as_it_is = _mean(scatter(one.lengths - one.wound))
    found = []
    for reading in _all_readings(one):
        lengths = one.lengths_with(*reading.poses)
        if not np.isfinite(lengths).all():
            continue
        left = scatter(lengths - one.wound)
        fits = (left <= one.limits(lengths)).all()
        better = not one.wrong.any() or _mean(left) < BETTER * as_it_is
        if fits and better and one.hangs(*reading.poses):
            found.append((reading, _mean(left)))
    return found


def _all_readings(one: Winding) -> Iterator[Reading]:
    yield from readings(one.bar, one.frame)
    if one.frame is None:
        return
    # One body may be read otherwise than the other.
    for each in readings(one.bar, None):
        yield each._replace(poses=(each.poses[0], one.frame), text=f"of the bar, {each.text}")


def _otherwise(one: Winding, fitting: list[tuple[Reading, float]]) -> Suspicion:
    """Return that poses fit when they are read otherwise, and how."""
    # The first that are tried are the simplest.
    likely = [each for each in fitting if each[1] <= NEAR * min(at for _, at in fitting) + 1e-4]
    first, left = likely[0]
    as_it_is = _mean(scatter(one.lengths - one.wound))
    text = f"contradicts the encoders, by inverse kinematics, by {1e3 * as_it_is:.3g} mm (RMS)"
    if not one.wrong.any():
        text = "lies above all its cables, which then only push it down"
    text += f"; fits the encoders within {1e3 * left:.2g} mm if {first.text}"
    for other, _ in likely[1:SHOWN]:
        text += f"; or if {other.text}"
    concerned = (BAR, FRAME)[: 1 if first.poses[1] is one.frame else 2]
    mend = {
        f"{body} {name}": {
            key: f"{body} {value}" if key == "of" else value for key, value in keys.items()
        }
        for body in concerned
        for name, keys in first.mend.items()
    }
    numbers = {"as_it_is": as_it_is, "left": left, "as_likely": float(len(likely) - 1)}
    return Suspicion(BAR, "axes", text, numbers, remedy=first.remedy, mend=mend)


def _moved_frame(one: Winding) -> Suspicion | None:
    """Return by how much the camera's frame is moved and turned, where that explains it."""

    def moved(offset: Array) -> Poses:
        turn = Rotation.from_rotvec(offset[3:])
        places = turn.apply(one.bar.places) + offset[:3]
        return poses(one.bar.time, places, (turn * one.bar.rotation()).as_quat())

    def apart(offset: Array) -> Array:
        left = np.nan_to_num(one.lengths_with(moved(offset), one.frame) - one.wound, nan=1e3)
        return np.asarray(((left - left.mean(axis=0)) / one.allowed).ravel())

    offset = least_squares(apart, np.zeros(6), max_nfev=30, loss="soft_l1").x
    lengths = one.lengths_with(moved(offset), one.frame)
    left, before = scatter(lengths - one.wound), scatter(one.lengths - one.wound)
    if not (left <= one.allowed).all() or _mean(left) > BETTER**2 * _mean(before):
        return None
    x, y, z = offset[:3]
    angle = float(np.degrees(np.linalg.norm(offset[3:])))
    text = (
        f"contradicts the encoders, by inverse kinematics, by {1e3 * _mean(before):.3g} mm (RMS);"
    )
    text += f" fits them within {1e3 * _mean(left):.2g} mm if its frame is moved by"
    text += f" ({x:.3g}, {y:.3g}, {z:.3g}) m and turned by {angle:.3g}°: another origin?"
    return Suspicion(BAR, "axes", text, {"x": x, "y": y, "z": z, "angle": angle})


def _unexplained(one: Winding) -> Suspicion:
    apart = scatter(one.lengths - one.wound)
    worst = int(np.argmax(apart / one.limits()))
    names = [name for name, wrong in zip(one.names, one.wrong, strict=True) if wrong]
    text = f"contradicts the encoders of {', '.join(names)}, by inverse kinematics: the length of"
    text += f" {one.names[worst]} by {1e3 * apart[worst]:.3g} mm (RMS), where stretch and survey"
    text += f" allow {1e3 * one.allowed[worst]:.3g} mm; no other axes, order or sign fit"
    return Suspicion(BAR, "kinematics", text, {"apart": float(apart[worst])})


def _mean(left: Array) -> float:
    return float(np.sqrt(np.mean(left**2)))
