"""The first files of a new robot, as text."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

from cspm.new.layout import Layout, Line

# Numbers of a robot of which nothing is known but its mass, so that all ratios are those of a
# laboratory's: cables that a body's weight stretches by 0.1 % per metre of it, winches that add 8 %
# of its mass, 2 % of its weight in damping per m/s.
DRUM_RADIUS = 0.025
YOUNGS_MODULUS = 8.7e9
RIGIDITY_PER_WEIGHT = 140.0
WINCH_SHARE = 0.08
DAMPING_PER_MASS = 4.0
# Tension limits as shares of the weight, and how much torque is left beyond the upper one.
LOWEST, HIGHEST, RESERVE = 0.02, 1.6, 1.5
GRAVITY = 9.81


class Accuracies(NamedTuple):
    """How well numbers are known, one standard deviation; None: as usual, so not in the file.

    Attributes:
        survey: of each coordinate of exits and attachments [m].
        mass: of the platform's mass [kg].
    """

    survey: float | None = None
    mass: float | None = None


def testbed_text(name: str, layout: Layout, mass: float, known: Accuracies) -> str:
    """Return the test-bed file of a robot of `mass` [kg], with comments."""
    first, *others = (_cable(line, known.survey) for line in layout.lines)
    more = "".join(f"  - <<: *winch\n{cable}\n" for cable in others)
    head = "SI units, radians, z down. Replace every number; keys: docs/reference/testbed-file.md"
    return (
        f"# {head}\nname: {name}\n{_platform(layout.half, mass, known.mass)}"
        f"cables: # a winch each\n  - &winch\n{first}\n{_winch(mass)}{more}"
        f"{_sensors(HIGHEST * mass * GRAVITY)}"
    )


def _known(value: str, accuracy: float | None) -> str:
    """Return a value, with its accuracy where that is known."""
    if accuracy is None:
        return value
    return f"{{value: {value}, provenance: measured, accuracy: {accuracy:g}}}"


def _platform(half: float, mass: float, accuracy: float | None) -> str:
    moment, side = mass * (2.0 * half) ** 2 / 6.0, f"{2.0 * half:.4g}"
    inertia = f"{{ixx: {moment:.4g}, iyy: {moment:.4g}, izz: {moment:.4g}}}"
    return f"""\
bar: # the platform; attachments and poses count from its origin
  mass: {_known(f"{mass:g}", accuracy)} # kg, with its load
  inertia: {inertia} # kg·m², about the centre of mass
  com: [0.0, 0.0, 0.0] # m, the centre of mass from the platform's origin
  dimensions: [{side}, {side}, {side}] # m, for drawing
"""


def _winch(mass: float) -> str:
    weight = mass * GRAVITY
    area = RIGIDITY_PER_WEIGHT * weight / YOUNGS_MODULUS
    highest, inertia = HIGHEST * weight, WINCH_SHARE * mass * DRUM_RADIUS**2
    return f"""\
    offset_length: 0.3 # m, from the drum to the exit
    stiffness: # E·A = {RIGIDITY_PER_WEIGHT * weight:.4g} N
      law: linear
      youngs_modulus: {YOUNGS_MODULUS:.2e} # Pa, a braided fibre rope; steel wire rope: 1.0e+11
      diameter: {(4.0 * area / pi) ** 0.5:.3e} # m
      floor_tension: {0.001 * weight:.3g} # N, below it the damping fades
    damping: {{constant: {DAMPING_PER_MASS * mass:g}}} # N·s/m, along the cable
    drum_radius: {DRUM_RADIUS:g} # m
    gear_ratio: 1.0 # motor turns per turn of the drum
    rotor_inertia: {inertia:.3g} # kg·m², all that turns, at the motor shaft
    torque_limit: {RESERVE * highest * DRUM_RADIUS:.3g} # N·m, at the motor shaft
    tension_limits: [{LOWEST * weight:.3g}, {highest:.4g}] # N, wanted at least and at most
"""


def _sensors(highest: float) -> str:
    noise, step = f"{highest / 3000:.2g}", f"{highest / 12000:.2g}"
    pose = "{noise: [1.0e-4, 2.0e-4], resolution: [0.0, 0.0], rate: 100}"
    winch = "{noise: [0.0, 0.01, 0.0], resolution: [7.67e-4, 0.0, 1.0e-4], rate: 1000}"
    return f"""\
sensors: # noise is a standard deviation, resolution a step, rate in Hz
  /bar/pose: {pose} # m, rad
  /winches/state: {winch} # rad, rad/s, N·m
  /cables/tension: {{noise: {noise}, resolution: {step}, rate: 1000}} # N
"""


def scenario_text(name: str, testbed: str, layout: Layout, radius: float) -> str:
    """Return the scenario of a circle of `radius` [m] about the robot's middle, with comments."""
    pose = f"[0.0, 0.0, {layout.heave:g}, 0.0, 0.0, 0.0]"
    turn = "[1.5708, 0.0, 0.0]" if layout.upright else "[0.0, 0.0, 0.0]"
    return f"""\
# Keys: docs/reference/scenario-file.md. `cspm run {name}.yaml --set KEY=VALUE` changes one.
name: {name}
description: a circle of {radius:g} m in 6 s
testbed: {testbed}
duration: 10.0 # s
seed: 1 # of the sensors' noise
rates: {{motion_capture: 100, motion_controller: 100, tension_distribution: 100}} # Hz
target: # where the platform is wanted; motions: circle, line, helix, waypoints, file, …
  mean_pose: {pose} # x y z [m], roll pitch yaw [rad]
  motion: {{type: circle, radius: {radius:g}, period: 6.0, turn: {turn}}}
control:
  mode: closed_loop
  motion:
    law: pid # gains are designed at design_pose, for every coordinate that the cables give
    design_pose: {pose}
requirement: {{position: 0.01, angle: 0.01}} # m, rad: what `cspm run` judges errors by
"""


def _cable(line: Line, accuracy: float | None) -> str:
    places = (", ".join(f"{v + 0.0:.4g}" for v in p) for p in line[1:])
    exit_, attachment = (_known(f"[{place}]", accuracy) for place in places)
    return (
        f"    name: {line.name}\n"
        f"    exit: {exit_} # m, where the cable leaves its last pulley, in the world\n"
        f"    attachment: {attachment} # m, on the platform"
    )
