"""How much of a phenomenon is as large as the noise of one reading.

A run without any phenomenon is looked at afterwards: what a unit of each would have added to the
torque of a shaft's equation, to a cable's tension, to the force on the bar or to a
reading, as root mean square over the part that is searched, against the standard deviation of one
reading of the same quantity. The limit is the amount at which both are equal, in the quantity that
shows the phenomenon best.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.blind.reality.marker_shift import tension_changes, wrench_changes
from bench.blind.reality.phenomena import PHENOMENA, shaft_radii
from bench.blind.reality.phenomenon import CABLES, Phenomenon
from bench.blind.reality.rope import elongations
from cspm_msgs_py.testbed import Testbed
from cspm_sim.mujoco.cable_law import elongation_at, law_row
from cspm_sim.mujoco.influence import Acting, Scene

Array = NDArray[np.float64]

_STILL = 1e-9
# For which a command is held [s]: a drive that is late by less shows it as one period.
_HELD = 1e-3
# By this much clocks run apart that nothing disciplines: quartz, without being a fault.
_QUARTZ = 25e-6
# By this much the clocks of a healthy machine differ [s]: offsets, and what they drift in a run.
_APART = 0.25e-3


class Noise(NamedTuple):
    """Standard deviations of one reading.

    Attributes:
        drive: of a drive's torque [N·m].
        shaft: of the torque that a shaft's equation misses, (n,) [N·m].
        tension: of measured tension less that of the cable's law, (n,) [N].
        cell: of a load cell as torque and radius show it, (n,) [N].
        force: of the sum of all tensions [N].
        moment: of all tensions about the bar's origin [N·m].
        position: of a body [m].
    """

    drive: float
    shaft: Array
    tension: Array
    cell: Array
    force: float
    moment: float
    position: float


def copied(scene: Scene) -> Scene:
    """Return a scene that stays as it is."""
    return Scene(scene.time, *(part.copy() for part in scene[1:]))


def detection_limits(scenes: Sequence[Scene], machine: Testbed) -> dict[str, list[float]]:
    """Return the limit of every phenomenon, per cable (n,) or once for the bar.

    Infinite where this run does not show it.

    Args:
        scenes: of the searched part of a run without phenomena, equally spaced.
        machine: as it is in that run.
    """
    slopes = stiffnesses(scenes, machine)
    noise = noise_of(machine, slopes)
    found = {}
    for name, phenomenon in PHENOMENA.items():
        if machine.bar is None and phenomenon.at != CABLES:
            found[name] = [float("inf")]
            continue
        shown = _shown(phenomenon, scenes, machine, slopes, noise)
        with np.errstate(divide="ignore"):
            limits = np.where(shown > _STILL, 1.0 / shown, np.inf)
        found[name] = [float(limit) for limit in np.atleast_1d(limits)]
    return found


def stiffnesses(scenes: Sequence[Scene], machine: Testbed) -> Array:
    """Return each cable's mean tangent stiffness, (n,) [N/m]."""
    out = np.zeros(len(machine.cables))
    for i, cable in enumerate(machine.cables):
        if cable.stiffness is None:
            continue
        row = np.array(law_row(cable.stiffness))
        tension = float(np.mean([scene.tensions[i] for scene in scenes]))
        length = float(np.mean([scene.unstretched[i] for scene in scenes])) + cable.offset_length
        rise = 0.01 * tension
        stretched = elongation_at(tension + rise, length, row) - elongation_at(tension, length, row)
        out[i] = rise / stretched
    return out


def noise_of(machine: Testbed, slopes: Array) -> Noise:
    """Return the noise of one reading, from the sensors that the test-bed describes.

    Where there is no bar, cables end where the file says, without noise.
    """
    position = machine.sensors["/bar/pose"].noise[0] if machine.bar is not None else 0.0
    winches = machine.sensors["/winches/state"]
    cell = machine.sensors["/cables/tension"].noise[0]
    radii = shaft_radii(machine)
    torque = float(np.hypot(winches.noise[2], winches.resolution[2] / np.sqrt(12.0)))
    arms = np.linalg.norm([cable.attachment or (0.0, 0.0, 0.0) for cable in machine.cables])
    shaft = np.hypot(torque, radii * cell)
    tension = np.hypot(cell, slopes * position)
    force = cell * float(np.sqrt(len(radii)))
    return Noise(torque, shaft, tension, shaft / radii, force, cell * float(arms), position)


def rms(values: Array) -> Array:
    """Return root mean squares over the first axis."""
    return np.asarray(np.sqrt(np.mean(np.square(values), axis=0)))


def _shown(
    phenomenon: Phenomenon,
    scenes: Sequence[Scene],
    machine: Testbed,
    slopes: Array,
    noise: Noise,
) -> Array:
    """Return signature over noise per unit of amount, (n,) or a number."""
    if phenomenon.alter is not None:
        return _NUMBERS[phenomenon.name](scenes, machine, slopes, noise)
    if phenomenon.faults is not None or phenomenon.clocks is not None:
        return _READINGS[phenomenon.name](scenes, machine, slopes, noise)
    if phenomenon.drive is not None:
        return _lagging(scenes, noise)
    shaft, tension, force = signatures(phenomenon, scenes, machine, slopes)
    own = np.maximum(rms(shaft) / noise.shaft, rms(tension) / noise.tension)
    shown = np.maximum(own, force / noise.force)
    return np.asarray(shown if phenomenon.at == CABLES else np.max(shown))


def signatures(
    phenomenon: Phenomenon, scenes: Sequence[Scene], machine: Testbed, slopes: Array
) -> tuple[Array, Array, Array]:
    """Return what one unit of it would have added, cable by cable.

    Returns:
        Torque on the shafts (times, n) [N·m], tension (times, n) [N], and the root mean square of
        the force on the bar (n,) [N] if it were on that cable alone.
    """
    n, radii = len(machine.cables), shaft_radii(machine)
    per_cable = phenomenon.at == CABLES
    amounts = np.full(n if per_cable else 1, phenomenon.unit)
    shaft, tension, forces = _watch(phenomenon, amounts, scenes, machine, slopes, radii)
    if per_cable and forces.any():
        forces = np.stack(
            [
                _watch(phenomenon, amounts * alone, scenes, machine, slopes, radii)[2]
                for alone in np.eye(n)
            ],
            axis=1,
        )
        force = np.linalg.norm(rms(forces), axis=1)
    else:
        force = np.full(n, np.linalg.norm(rms(forces)))
    return shaft / phenomenon.unit, tension / phenomenon.unit, force / phenomenon.unit


def _watch(
    phenomenon: Phenomenon,
    amounts: Array,
    scenes: Sequence[Scene],
    machine: Testbed,
    slopes: Array,
    radii: Array,
) -> tuple[Array, Array, Array]:
    assert phenomenon.influence is not None
    influence = phenomenon.influence(amounts, machine, np.random.default_rng(0))
    acting = Acting(len(radii))
    rows: tuple[list[Array], list[Array], list[Array]] = ([], [], [])
    before = scenes[0].time
    for scene in scenes:
        influence.advance(scene, scene.time - before)
        before = scene.time
        acting.clear(radii)
        influence.act(scene, acting)
        rows[0].append(acting.torque - (acting.radius - radii) * scene.tensions)
        rows[1].append(acting.tension - slopes * acting.length)
        rows[2].append(acting.wrench[:3].copy())
    shaft, tension, force = (np.array(part) for part in rows)
    return shaft, tension, force


def _speeds(scenes: Sequence[Scene]) -> Array:
    return np.array([scene.speeds for scene in scenes])


def _tensions(scenes: Sequence[Scene]) -> Array:
    return np.array([scene.tensions for scene in scenes])


def dampers(machine: Testbed, scenes: Sequence[Scene]) -> Array:
    """Return what each cable's damper gives, (times, n) [N]."""
    times = np.array([scene.time for scene in scenes])
    rates = np.gradient(np.array([elongations(scene) for scene in scenes]), times, axis=0)
    lengths = np.mean([scene.unstretched for scene in scenes], axis=0)
    coefficients = [
        c.damping.factor
        * max(0.0, c.damping.constant - c.damping.slope * (length + c.offset_length))
        if c.damping
        else 0.0
        for c, length in zip(machine.cables, lengths, strict=True)
    ]
    return np.asarray(rates * np.array(coefficients))


def _mass(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    return np.asarray(machine.gravity / noise.force)


def _bar_inertia(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    times = np.array([scene.time for scene in scenes])
    across = np.array([scene.body[7:9] for scene in scenes])
    return np.asarray(np.linalg.norm(rms(np.gradient(across, times, axis=0))) / noise.moment)


def _bar_com(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    assert machine.bar is not None
    return np.asarray(machine.bar.mass * machine.gravity / noise.moment)


def _stiffness(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    return rms(_tensions(scenes)) / noise.tension


def _damper(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    return rms(dampers(machine, scenes)) / noise.tension


def _inertia(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    times = np.array([scene.time for scene in scenes])
    return rms(np.gradient(_speeds(scenes), times, axis=0)) / noise.shaft


def _radius(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    ratios = np.array([cable.gear_ratio for cable in machine.cables])
    torque = rms(_tensions(scenes)) / ratios / noise.shaft
    return np.asarray(np.maximum(torque, slopes * rms(_turns(scenes)) / ratios / noise.tension))


def _turns(scenes: Sequence[Scene]) -> Array:
    return np.array([scene.angles for scene in scenes])


def _cell_zero(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    return np.asarray(1.0 / np.minimum(noise.cell, noise.tension))


def _cell_scale(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    return rms(_tensions(scenes)) / np.minimum(noise.cell, noise.tension)


def _counts(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    wound = shaft_radii(machine) * rms(_turns(scenes))
    return np.asarray(slopes * wound / noise.tension)


def _late(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    velocity = np.array([scene.body[3:6] - scene.frame[3:6] for scene in scenes])
    shown = np.linalg.norm(rms(velocity)) / noise.position
    return np.asarray(min(shown, 1.0 / _APART))


def _skewed(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    times = np.array([scene.time for scene in scenes])
    velocity = np.array([scene.body[3:6] - scene.frame[3:6] for scene in scenes])
    shown = np.linalg.norm(rms(times[:, None] * velocity)) / noise.position
    return np.asarray(min(shown, 1.0 / _QUARTZ))


def _lagging(scenes: Sequence[Scene], noise: Noise) -> Array:
    times = np.array([scene.time for scene in scenes])
    torques = np.array([scene.torque for scene in scenes])
    return np.minimum(rms(np.gradient(torques, times, axis=0)) / noise.drive, 1.0 / _HELD)


def _shifted(scenes: Sequence[Scene], machine: Testbed, slopes: Array, noise: Noise) -> Array:
    tension = np.max(rms(tension_changes(scenes, slopes)) / noise.tension)
    wrenches = wrench_changes(scenes)
    force, moment = (np.linalg.norm(rms(part)) for part in np.split(wrenches, 2, axis=1))
    return np.asarray(max(tension, force / noise.force, moment / noise.moment))


_NUMBERS = {
    "mass": _mass,
    "inertia of the bar": _bar_inertia,
    "centre of mass": _bar_com,
    "stiffness": _stiffness,
    "damper": _damper,
    "inertia": _inertia,
    "radius": _radius,
}
_READINGS = {
    "cell zero": _cell_zero,
    "warming cell": _cell_zero,
    "cell scale": _cell_scale,
    "encoder counts": _counts,
    "late tracker": _late,
    "fast clock": _skewed,
    "shifted markers": _shifted,
}


def absorbed_share(
    phenomenon: str, number: str, scenes: Sequence[Scene], machine: Testbed
) -> list[float]:
    """Return by how much a number of the file goes wrong per unit of a phenomenon, (n,).

    That is what least squares give a laboratory that fits the number while the phenomenon acts.
    """
    slopes = stiffnesses(scenes, machine)
    shaft, tension, _ = signatures(PHENOMENA[phenomenon], scenes, machine, slopes)
    ratios = np.array([cable.gear_ratio for cable in machine.cables])
    columns: Mapping[str, tuple[Array, Array]] = {
        "damper": (tension, dampers(machine, scenes)),
        "stiffness": (tension, _tensions(scenes)),
        "radius": (shaft, -_tensions(scenes) / ratios),
    }
    return _shares(*columns[number])


def likeness(phenomenon: str, scenes: Sequence[Scene], machine: Testbed) -> list[float]:
    """Return how much of the catalogue's parameter a unit of a phenomenon is, (n,).

    Where the forms differ that is what least squares give in a run without it; 1 where they do not.
    """
    column = PHENOMENA[phenomenon].column
    if column is None:
        return [1.0] * len(machine.cables)
    shaft, _, _ = signatures(PHENOMENA[phenomenon], scenes, machine, stiffnesses(scenes, machine))
    return _shares(shaft, np.array([column(scene) for scene in scenes]))


def _shares(signature: Array, column: Array) -> list[float]:
    """Return how much of each column (times, n) is in the signature beside it, by least squares."""
    return [float(share) for share in np.sum(signature * column, 0) / np.sum(column**2, 0)]
