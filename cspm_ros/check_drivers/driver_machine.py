"""Whether the topics of one machine agree: axes, weight, lengths, torques, velocities.

Topics are compared by their stamps; those whose stamps are on different clocks cannot be.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

import numpy as np

from cspm_msgs_py.errors import SingularityError
from cspm_msgs_py.testbed import Cable, Testbed
from cspm_ros.check_drivers.driver_geometry import Geometry, geometry_over_time
from cspm_ros.check_drivers.driver_observation import Array, Finding, Heard, seconds
from cspm_ros.check_drivers.driver_relation import (
    ANGLE_UNITS,
    HELD_UNITS,
    LENGTH_UNITS,
    SPEED_UNITS,
    TENSION_UNITS,
    TORQUE_UNITS,
    Series,
    Verdict,
    factor_fault,
    factor_name,
    grouped,
    rate_relation,
    value_relation,
    verdict_on,
)
from cspm_ros.check_drivers.driver_values import LOWEST_TENSION, counted_through

BAR_POSE, FRAME_POSE = "/bar/pose", "/winch_frame/pose"
WINCHES, TENSION = "/winches/state", "/cables/tension"
LEAST_OVERLAP = 0.5
LEAST_DEPTH = 1e-3  # m
STRETCH = 2e-3  # m, by which a cable's length may change without its winch
LENGTH_TOLERANCE = 0.35  # what that stretch, or slack, may do to the factor of a small motion
END_SHARE = 0.1  # of the window, over which the velocity at its ends is fitted
WEIGHT_TOLERANCE = 0.15
HANGING, LEAST_LOAD = 0.05, 0.3  # share of the weight
LEAST_TENSION = 0.5  # N
INERTIA_SHARE = 0.3  # of the torque, that may speed a winch up
TORQUE_TOLERANCE = 0.5  # friction takes or adds that much


def check_machine(
    testbed: Testbed, heard: Mapping[str, Heard], faulty: Collection[str]
) -> list[Finding]:
    """Judge topics against each other.

    Args:
        testbed: the machine.
        heard: what was heard, by topic, with finite numbers and increasing stamps.
        faulty: topics whose numbers are known to be wrong.
    """
    findings = []
    for body in ("/winch_frame", "/bar"):
        if f"{body}/twist" in heard:
            findings += list(_twist(heard, faulty, body))
    if testbed.bar is not None and testbed.gravity:
        findings += _hanging(testbed, heard, faulty)
    # Where no weight shows the tensions' unit, the torques may.
    comparable = TENSION not in faulty or testbed.bar is None
    if WINCHES in heard and TENSION in heard and comparable:
        findings += _torques(testbed, heard[WINCHES], heard[TENSION])
    return findings


def _obstacle(names: list[str], heard: Mapping[str, Heard], faulty: Collection[str]) -> str:
    """Return why these topics cannot be compared, empty if they can."""
    for name in names:
        if name not in heard or name in faulty:
            return f"cannot decide without a usable {name}"
    starts = [int(heard[name].value_stamp_ns[0]) for name in names]
    ends = [int(heard[name].value_stamp_ns[-1]) for name in names]
    shortest = min(end - start for start, end in zip(starts, ends, strict=True))
    if min(ends) - max(starts) < LEAST_OVERLAP * shortest:
        return f"cannot decide: the stamps of {' and '.join(names)} are not of the same time"
    return ""


def _hanging(
    testbed: Testbed, heard: Mapping[str, Heard], faulty: Collection[str]
) -> list[Finding]:
    """Judge what needs the machine's geometry: where z points, the weight, the lengths."""
    poses = [BAR_POSE] + [FRAME_POSE] * (testbed.winch_frame is not None)
    obstacle = _obstacle(poses, heard, faulty)
    if obstacle:
        return [Finding(BAR_POSE, "axes", None, obstacle)]
    try:
        shape = geometry_over_time(testbed, heard[BAR_POSE], heard.get(FRAME_POSE))
    except SingularityError as err:
        return [Finding(BAR_POSE, "axes", False, f"impossible pose: {err}")]
    findings = [_axes(shape)]
    if findings[0].ok is False:
        return findings
    for name, check in ((TENSION, _balance), (WINCHES, _lengths)):
        if name in heard:
            obstacle = _obstacle([BAR_POSE, name], heard, ())
            findings += (
                [Finding(name, "geometry", None, obstacle)]
                if obstacle
                else check(testbed, shape, heard[name])
            )
    return findings


def _axes(shape: Geometry) -> Finding:
    depth = float(np.median(shape.depth))
    if abs(depth) < LEAST_DEPTH:
        return Finding(BAR_POSE, "axes", None, "cannot decide: the bar is as high as the exits")
    if depth > 0:
        text = f"z points down: the bar is {depth:.3g} m below the exits"
        return Finding(BAR_POSE, "axes", True, text)
    text = f"the bar seems {-depth:.3g} m above the exits: z points up, expected: down"
    return Finding(BAR_POSE, "axes", False, text)


def _balance(testbed: Testbed, shape: Geometry, tension: Heard) -> list[Finding]:
    """Judge the cables' mean lift against the weight, and the momentum that the bar gained."""
    tensions = tension.part("effort")
    if tensions is None or testbed.bar is None:
        return []
    negative = tensions.mean(axis=0) < LOWEST_TENSION
    if negative.any() and not negative.all():
        return [Finding(TENSION, "balance", None, "cannot decide with some tensions negative")]
    times = seconds(tension.value_stamp_ns - shape.start_ns)
    window = shape.times[-1]
    (early, first), (late, last) = _velocities(shape.times, shape.com_z, END_SHARE * window)
    inside = (times >= early) & (times <= late)
    if late <= early or not inside.any():
        return [Finding(TENSION, "balance", None, "cannot decide from so few messages")]
    lift = np.array([np.interp(times[inside], shape.times, c) for c in shape.lift.T]).T
    carried = float(np.mean((lift * tensions[inside]).sum(axis=1)))
    needed = testbed.bar.mass * (testbed.gravity - (last - first) / (late - early))
    text = f"the cables lift {carried:.4g} where the bar needs {needed:.4g} N"
    if needed < LEAST_LOAD * testbed.bar.mass * testbed.gravity:
        return [Finding(TENSION, "balance", None, f"{text}: it falls too fast to decide")]
    if abs(carried) < HANGING * needed:
        return [Finding(TENSION, "balance", None, f"{text}: does it hang?")]
    fault = factor_fault(carried / needed, TENSION_UNITS, WEIGHT_TOLERANCE)
    return [Finding(TENSION, "balance", not fault, f"{text}: {fault}" if fault else text)]


def _velocities(times: Array, values: Array, span: float) -> list[tuple[float, float]]:
    """Return time and slope of lines through the first and last `span` [s] of a signal."""
    ends = [times <= times[0] + span, times >= times[-1] - span]
    if min(int(end.sum()) for end in ends) < 2:
        return [(float(times[0]), 0.0), (float(times[0]), 0.0)]
    return [(float(times[e].mean()), float(np.polyfit(times[e], values[e], 1)[0])) for e in ends]


def _lengths(testbed: Testbed, shape: Geometry, winches: Heard) -> list[Finding]:
    """Judge each winch's angle by the length that its cable has by the poses."""
    angles = winches.part("position")
    if angles is None:
        return []
    times = seconds(winches.value_stamp_ns - shape.start_ns)
    verdicts: dict[str, Verdict] = {}
    for cable, angle, length in zip(testbed.cables, angles.T, shape.lengths.T, strict=True):
        turned_by = counted_through(Series(times, angle))[0].values
        unwound = Series(times, -_radius(cable) * turned_by)
        relation = value_relation(Series(shape.times, length), unwound, STRETCH)
        what = "the angle that the poses give"
        units = _with_drum(cable, ANGLE_UNITS, -1)
        hint = ": swapped cables, or poses in other axes?"
        verdicts[cable.name] = verdict_on(relation, units, what, hint, LENGTH_TOLERANCE)
    return grouped(WINCHES, "length", verdicts)


def _radius(cable: Cable) -> float:
    return cable.wound_radius


def _with_drum(cable: Cable, units: Mapping[float, str], power: int) -> dict[float, str]:
    """Return the units and the factor of a quantity at the drum instead of the motor shaft."""
    if cable.gear_ratio == 1.0:
        return dict(units)
    return {cable.gear_ratio**power: "at the drum, not the motor shaft", **units}


def _torques(testbed: Testbed, winches: Heard, tension: Heard) -> list[Finding]:
    """Judge each winch's mean torque by the tension that it holds."""
    torques, tensions = winches.part("effort"), tension.part("effort")
    if torques is None or tensions is None:
        return []
    spin = _spin(winches)
    verdicts: dict[str, Verdict] = {}
    for i, cable in enumerate(testbed.cables):
        if not cable.has_cable:
            continue
        held, pull = float(torques[:, i].mean()) / _radius(cable), float(tensions[:, i].mean())
        units = _with_drum(cable, TORQUE_UNITS, 1) | (HELD_UNITS if testbed.bar is None else {})
        if cable.rotor_inertia * abs(spin[i]) > INERTIA_SHARE * _radius(cable) * abs(pull):
            verdicts[cable.name] = None, "cannot decide the torque's unit: the winch gains speed"
        else:
            verdicts[cable.name] = _torque_verdict(held, pull, units)
    return grouped(WINCHES, "holding", verdicts)


def _spin(winches: Heard) -> Array:
    """Return the mean acceleration of each motor (n,) [rad/s²], 0 without speeds."""
    speeds, times = winches.part("velocity"), winches.value_times
    if speeds is None:
        return np.zeros(len(winches.topic.joint_names))
    count = max(1, round(END_SHARE * len(speeds)))
    gained = speeds[-count:].mean(axis=0) - speeds[:count].mean(axis=0)
    spin: Array = gained / times[-1]
    return spin


def _torque_verdict(held: float, tension: float, units: Mapping[float, str]) -> Verdict:
    """Judge the force at the drum that a torque holds by the cable's tension [N]."""
    what = "the torque that holds the tension"
    if tension < LEAST_TENSION:
        return None, "cannot decide the torque's unit: the cable carries hardly anything"
    name = factor_name(held / tension, units, TORQUE_TOLERANCE)
    if name is None:
        return None, f"{held / tension:.1f} × {what}: do friction or a brake hold it?"
    return not name, f"{what}, but {name}" if name else f"about {what}"


def _twist(heard: Mapping[str, Heard], faulty: Collection[str], body: str) -> Iterator[Finding]:
    """Judge a measured twist by the measured pose's derivative."""
    name, pose = f"{body}/twist", f"{body}/pose"
    obstacle = _obstacle([pose, name], heard, faulty)
    if obstacle:
        yield Finding(name, "speed", None, obstacle)
        return
    start = heard[pose].value_stamp_ns[0]
    times = heard[pose].value_times
    rate_times = seconds(heard[name].value_stamp_ns - start)
    values = np.hstack([heard[pose].values[:, :3], turned(heard[pose].values[:, 3:])])
    verdicts: dict[str, Verdict] = {}
    columns = zip(heard[name].topic.fields, values.T, heard[name].values.T, strict=True)
    for i, (field, value, rate) in enumerate(columns):
        relation = rate_relation(Series(times, value), Series(rate_times, rate))
        units = LENGTH_UNITS if i < 3 else SPEED_UNITS
        verdicts[field] = verdict_on(relation, units, "the derivative of the pose")
    yield from grouped(name, "speed", verdicts)


def turned(quaternions: Array) -> Array:
    """Return the integral of ω in world axes (n, 3) [rad] over the attitudes x y z w (n, 4)."""
    # Loading it takes half a second, which not all that imports this module uses.
    from scipy.spatial.transform import Rotation

    attitudes = Rotation.from_quat(quaternions)
    steps = (attitudes[1:] * attitudes[:-1].inv()).as_rotvec()
    return np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
