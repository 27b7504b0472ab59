"""A library of motions that show different things of a machine, none beyond what it has done."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from cspm_ident.experiment.envelope import Reach, pose_reach, reach_of
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.motion_spec import JonswapMotion, Move, MovesMotion, Six
from cspm_msgs_py.scenario import AnglePath, AngleProfile, Scenario
from cspm_msgs_py.scenario_keys.bodies import Body, Target

Array = NDArray[np.float64]

DURATION_S = 30.0
_ROLL = 3
_RAMP_S = 4.0
# Peak speed of a minimum-jerk move over its mean speed.
_JERK_PEAK = 1.875
_REST_S = 0.6
# Below this a frame did not move but for noise [m, rad].
_STILL = 2e-3


def excitations(measurement: Measurement, testbed: str, share: float = 1.0) -> Iterator[Scenario]:
    """Yield scenarios for the measured machine, each of `DURATION_S`.

    Args:
        measurement: whose excursions and speeds bound those of the scenarios.
        testbed: the test-bed file's name, as the scenario is to have it.
        share: of the excursions and of the moves' speeds.
    """
    bar, frame = pose_reach(measurement, "bar"), pose_reach(measurement, "frame")
    if measurement.machine.bar is None:
        yield from _rig_excitations(measurement, testbed, share)
    elif bar is not None:
        moved = frame if frame is not None and np.any(frame.excursion > _STILL) else None
        yield from _bar_excitations(bar, moved, testbed, share)


def _bar_excitations(
    bar: Reach, frame: Reach | None, testbed: str, share: float
) -> Iterator[Scenario]:
    reach, speed = share * bar.excursion, share * bar.speed
    reach[_ROLL] = 0.0
    pace = float(np.median(bar.speed / (2.0 * pi * bar.excursion)))
    home = Target(mean_pose=_six(bar.mean, _ROLL))
    for name, size, frequency in (
        ("slow", 1.0, 0.2 * pace),
        ("even", 1.0, pace),
        ("quick", 0.5, 2.0 * pace),
    ):
        sea = home.model_copy(update={"motion": _sea(size * reach, frequency)})
        yield _scenario(f"{name}_sea", testbed, sea)
    for name, moves in (
        ("one_axis_after_the_other", _axis_moves(reach, speed)),
        ("postures", _postures(reach, speed)),
        ("heights", _ladder(reach, speed)),
        ("reversals_at_levels", _reversals(reach, speed)),
    ):
        path = home.model_copy(update={"motion": MovesMotion(moves=tuple(moves))})
        yield _scenario(name, testbed, path)
    if frame is not None:
        pace = float(np.max(frame.speed) / (2.0 * pi * np.max(frame.excursion)))
        motion = _sea(share * frame.excursion, pace)
        moving = Body(mean_pose=_six(frame.mean), motion=motion)
        yield _scenario("frame_alone", testbed, home, moving)


def _scenario(name: str, testbed: str, target: Target, frame: Body | None = None) -> Scenario:
    return Scenario(
        name=name,
        testbed=testbed,
        duration=DURATION_S,
        target=target,
        winch_frame=frame or Body(),
    )


def _six(values: Array, without: int | None = None) -> Six:
    rounded = [float(f"{value:.4g}") for value in values]
    if without is not None:
        rounded[without] = 0.0
    x, y, z, roll, pitch, yaw = rounded
    return (x, y, z, roll, pitch, yaw)


def _sea(reach: Array, frequency: float) -> JonswapMotion:
    """Return waves of half an octave to both sides of a frequency [Hz], rare ones left out."""
    # The bar's own modes and the drives set no limit here: the plan's torques and tensions do.
    frequency = float(np.clip(frequency, 0.1, 2.0))
    return JonswapMotion(
        peak_period=float(f"{1.0 / frequency:.3g}"),
        heading=0.7,
        band=(float(f"{0.6 * frequency:.3g}"), float(f"{1.8 * frequency:.3g}")),
        amplitudes=_six(reach),
        period=DURATION_S,
        ramp=_RAMP_S,
    )


def _axis_moves(reach: Array, speed: Array) -> Iterator[Move]:
    """Yield moves there, across and back along every coordinate, one after the other."""
    time = 1.0
    for axis in range(len(DOFS)):
        for step in (1.0, -2.0, 1.0):
            by = np.zeros(6)
            by[axis] = step * reach[axis]
            if by[axis]:
                move = _move(time, by, speed)
                time = move.end + 0.1
                yield move


def _postures(reach: Array, speed: Array) -> Iterator[Move]:
    """Yield moves between poses that differ in several coordinates, with a rest at each."""
    time, here = 1.0, np.zeros(6)
    corners = (
        (1, 1, 0, 0, 1, 1),
        (-1, 1, 1, 0, -1, 1),
        (-1, -1, 0, 0, 1, -1),
        (1, -1, -1, 0, -1, -1),
    )
    for corner in (*corners, (0, 0, 0, 0, 0, 0)):
        there = 0.7 * reach * np.array(corner, dtype=float)
        move = _move(time, there - here, 0.5 * speed)
        here, time = there, move.end + _REST_S
        yield move


def _ladder(reach: Array, speed: Array) -> Iterator[Move]:
    """Yield moves down and up in steps, with a rest at each, slow then quick."""
    time = 1.0
    for pace in (0.3, 1.0):
        for step in (0.5, 0.5, -0.5, -0.5, -0.5, -0.5, 0.5, 0.5):
            by = np.zeros(6)
            by[2] = step * reach[2]
            move = _move(time, by, pace * speed)
            time = move.end + _REST_S
            yield move


def _reversals(reach: Array, speed: Array) -> Iterator[Move]:
    """Yield moves up and down at places to the side, where the cables' tensions differ."""
    time, here = 1.0, np.zeros(6)
    for level in (0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5, 0.0):
        there = level * reach * np.array([1.0, 1.0, 0.0, 0.0, 1.0, 1.0])
        path = [there - here, *(np.array([0.0, 0.0, s * reach[2], 0, 0, 0]) for s in (1, -2, 1))]
        for by in path:
            move = _move(time, by, speed)
            time = move.end
            yield move
        here = there


def _move(time: float, by: Array, speed: Array) -> Move:
    """Return a move that nowhere exceeds the speeds given."""
    least = np.max(_JERK_PEAK * np.abs(by) / np.maximum(speed, 1e-6))
    return Move(at=_grid(time), duration=_grid(max(float(least), 0.2)), by=_six(by))


def _grid(time: float) -> float:
    return ceil(time * 100.0 - 1e-9) / 100.0


def _rig_excitations(measurement: Measurement, testbed: str, share: float) -> Iterator[Scenario]:
    """Yield ramps of the motors' angles, up and down at one or two speeds and levels."""
    if measurement.angle is None:
        return
    reach = reach_of(measurement.angle)
    tension = None if measurement.tension is None else reach_of(measurement.tension).mean
    half = share * reach.excursion
    for name, speed, shape in (
        ("slow_reversals", 0.2, (0.0, 1.0, -1.0, 0.0)),
        ("quick_reversals", 1.0, (0.0, 1.0, -1.0, 0.0)),
        ("levels", 0.4, (0.0, 0.3, 0.0, 0.6, 0.3, 1.0, 0.6, 1.0, 0.0, -0.6, -0.3, -1.0, 0.0)),
    ):
        paths = {}
        for i, cable in enumerate(measurement.machine.cable_names):
            if half[i] > 0.0:
                carried = 0.0 if tension is None else max(0.0, float(tension[i]))
                paths[cable] = _ramps(shape, float(half[i]), speed * float(reach.speed[i]), carried)
        control = AngleProfile(angle=paths)
        yield Scenario(name=name, testbed=testbed, duration=DURATION_S, control=control)


def _ramps(shape: Sequence[float], half: float, speed: float, tension: float) -> AnglePath:
    times, angles = [0.0], [0.0]
    for start, end in pairwise(shape):
        times.append(_grid(times[-1] + max(0.05, abs(end - start) * half / max(speed, 1e-9))))
        angles.append(float(f"{end * half:.4g}"))
    cycles = max(1, int(DURATION_S / times[-1]))
    points = tuple(zip(times, angles, strict=True))
    return AnglePath(points=points, cycles=cycles, tension=float(f"{tension:.4g}"))
