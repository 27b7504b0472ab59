"""The runs behind results/steep-sea.md."""

from __future__ import annotations

from dataclasses import replace

from bench.results.tracking import Case
from cspm_msgs_py.dofs import Dof

PAST, SIX, DEEP = (
    "worst_case_steep_past_thesis",
    "worst_case_steep_six_dof",
    "worst_case_steep_4m_past_thesis",
)
CAMERA_100_HZ = (
    "rates.motion_capture=100",
    "rates.motion_controller=100",
    "rates.tension_distribution=100",
)
PROFILES: dict[str, tuple[str, ...]] = {"1000 Hz": (), "100 Hz": CAMERA_100_HZ}
PAST_ON_CALM = (
    "control={mode: closed_loop, motion: {law: computed_wrench, governor: {}},"
    " tension_distribution: {method: analytic_centre, lower_limit: 0.3}}"
)
# The calm sea is to be followed ten times as closely.
TENTH = ("duration=200", PAST_ON_CALM, "requirement={position: 0.0002, angle: 0.0004}")
FOUR_METRES = "target.mean_pose=[0.0, 0.0, 4.0, 0.0, 0.0, 0.0]"
CENTRE = ("control.mode=closed_loop", "control.tension_distribution.method=analytic_centre")
ONE_NEWTON = "control.tension_distribution.lower_limit=1.0"
LOWER = "control.tension_distribution.lower_limit=0.3"
ROBUST = "duration=20"
KNOWN_WIND = "control.motion.known_wrench=[1.0, 2.0, 0.0, 0.0, 0.0, 0.0]"
BLOWN = "worst case, 20 s, wind of 2 N in sway and 1 N in surge"

THESIS = {
    "calm": Case("calm_broadband", ("duration=200",)),
    "worst case": Case("worst_case_steep"),
    "worst case, 4 m": Case("worst_case_steep_4m"),
}
HALF = "duration=100"
MINUTE = "duration=60"
SHORT = "duration=40"
IDEAL = "sensors=ideal"
HALF_WAVES = (
    "target.motion.amplitudes=[0.055, 0.043, 0.159, 0.0135, 0.108, 0.053]",
    "winch_frame.motion.amplitudes=[0.0094, 0.0044, 0.0124, 0.0034, 0.0033, 0.0017]",
)
# About the fastest loops that the thesis's margins allow [rad/s]; its gains are lost.
FASTEST_CROSSOVER: dict[Dof, int] = {"surge": 32, "sway": 18, "heave": 40, "pitch": 40, "yaw": 18}
FASTEST = (
    "control.mode=closed_loop",
    f"control.motion.crossover={{{', '.join(f'{d}: {w}' for d, w in FASTEST_CROSSOVER.items())}}}",
)
# As the fastest, but sway at 36 rad/s, with a gain margin of 3.1 instead of 6 dB.
FASTER_SWAY = (
    "control.mode=closed_loop",
    "control.motion.gains={surge: {kp: 1104, ki: 822, kd: 96.3},"
    " sway: {kp: 1010, ki: 845, kd: 78.3}, heave: {kp: 3820, ki: 3554, kd: 266.5},"
    " pitch: {kp: 515.2, ki: 479.3, kd: 35.94}, yaw: {kp: 32.86, ki: 13.75, kd: 5.094}}",
)
# The same with 1.75 times the proportional gain in sway and all else of it to go with that.
FASTEST_SWAY = (
    "control.mode=closed_loop",
    "control.motion.gains={surge: {kp: 1104, ki: 822, kd: 96.3},"
    " sway: {kp: 1767, ki: 1956, kd: 103.6}, heave: {kp: 3820, ki: 3554, kd: 266.5},"
    " pitch: {kp: 515.2, ki: 479.3, kd: 35.94}, yaw: {kp: 32.86, ki: 13.75, kd: 5.094}}",
)
# What a sea from abeam does to a symmetric ship.
BEAM = (
    "target.motion.amplitudes=[0.0, 0.0865, 0.318, 0.027, 0.0, 0.0]",
    "winch_frame.motion.amplitudes=[0.0, 0.0088, 0.0248, 0.0067, 0.0, 0.0]",
)
LONG_WAVES = ("target.motion.band=[0.21, 0.25]", "winch_frame.motion.band=[0.21, 0.25]")
# The thesis's worst case with one thing changed.
SWITCHED = {
    "as in the thesis": Case("worst_case_steep", (HALF,)),
    "ideal sensors": Case("worst_case_steep", (HALF, IDEAL)),
    "analytic centre": Case("worst_case_steep", (HALF, *CENTRE)),
    "analytic centre, wanted tensions down to 0.3 N": Case(
        "worst_case_steep", (HALF, *CENTRE, LOWER)
    ),
    "half the waves": Case("worst_case_steep", (HALF, *HALF_WAVES)),
}
# The same with the gains changed, without sensor noise, which gains of this size amplify.
SWITCHED_GAINS = {
    "fastest loops": Case("worst_case_steep", (HALF, IDEAL, *FASTEST)),
    "the same, analytic centre, down to 0.3 N": Case(
        "worst_case_steep", (HALF, IDEAL, *FASTEST, *CENTRE, LOWER)
    ),
    "the same, sway beyond its margin": Case(
        "worst_case_steep", (HALF, IDEAL, *FASTER_SWAY, *CENTRE, LOWER)
    ),
    "the same, sway with 1.75 times that gain": Case(
        "worst_case_steep", (HALF, IDEAL, *FASTEST_SWAY, *CENTRE, LOWER)
    ),
}
SWITCHED_CALM = {
    "as in the thesis": Case("calm_broadband", (MINUTE,)),
    "motions of a sea from abeam": Case("calm_broadband", (MINUTE, *BEAM)),
    "the same, fastest loops, ideal sensors": Case(
        "calm_broadband", (MINUTE, IDEAL, *FASTEST, *BEAM)
    ),
    "the same, sway beyond its margin": Case(
        "calm_broadband", (MINUTE, IDEAL, *FASTER_SWAY, *BEAM)
    ),
    "fastest loops, and no wave shorter than 4 s": Case(
        "calm_broadband", (MINUTE, IDEAL, *FASTEST, *BEAM, *LONG_WAVES)
    ),
    "no wave shorter than 4 s, sway beyond its margin": Case(
        "calm_broadband", (MINUTE, IDEAL, *FASTER_SWAY, *BEAM, *LONG_WAVES)
    ),
    "no wave shorter than 4 s, sway with 1.75 times that gain": Case(
        "calm_broadband", (MINUTE, IDEAL, *FASTEST_SWAY, *BEAM, *LONG_WAVES)
    ),
}
# At 4 m the thesis's margins leave sway and yaw no more than 9 rad/s.
DESIGNED_AT_FOUR = (
    "control={mode: closed_loop, motion: {design_pose: [0, 0, 4, 0, 0, 0],"
    " crossover: {surge: 12, sway: 9, heave: 12, pitch: 12, yaw: 9}},"
    " tension_distribution: {method: pseudo_inverse}}"
)
SWITCHED_4M = {
    "as in the thesis": Case("worst_case_steep_4m", (SHORT,)),
    "gains designed at 4 m": Case("worst_case_steep_4m", (SHORT, DESIGNED_AT_FOUR)),
    "ideal sensors": Case("worst_case_steep_4m", (SHORT, IDEAL)),
    "half the waves": Case("worst_case_steep_4m", (SHORT, *HALF_WAVES)),
    "analytic centre": Case("worst_case_steep_4m", (SHORT, *CENTRE)),
    "wanted tensions down to 0.3 N": Case("worst_case_steep_4m", (SHORT, *CENTRE, LOWER)),
}
# A seed that meets the limit within 40 s, without the governor, with one thing changed.
UNGOVERNED = "control.motion.governor=null"
ROUGH = (SHORT, "seed=6", UNGOVERNED)
CAUSES = {
    "without the governor": Case(PAST, ROUGH),
    "ideal sensors": Case(PAST, (*ROUGH, IDEAL)),
    "force controllers at 1000 instead of 800 rad/s": Case(
        PAST, (*ROUGH, "control.force.bandwidth=1000")
    ),
    "wanted tensions down to 0.05 N": Case(
        PAST, (*ROUGH, "control.tension_distribution.lower_limit=0.05")
    ),
    "half the waves": Case(PAST, (*ROUGH, *HALF_WAVES)),
    "with the governor": Case(PAST, ROUGH[:2]),
}
BEYOND = {
    "worst case": Case(PAST, (SHORT,)),
    "without the governor": Case(PAST, (SHORT, UNGOVERNED)),
    "wanted tensions down to 1 N": Case(PAST, (SHORT, ONE_NEWTON)),
    "poses 5 ms late, which it knows": Case(PAST, (SHORT,), pose_delay=0.005),
    "force controllers at 400 instead of 800 rad/s": Case(
        PAST, (SHORT, "control.force.bandwidth=400")
    ),
    "dry friction 10 mN·m at every motor": Case(
        PAST, (SHORT,), (("winch_coulomb_friction", (), {"torque": 0.01}),)
    ),
    "calm": Case("calm_broadband", (SHORT, PAST_ON_CALM)),
    "all six coordinates": Case(SIX, (SHORT,)),
    "all six coordinates, the whole 200 s": Case(SIX),
    "all six coordinates, 200 s, seed 2": Case(SIX, ("seed=2",)),
    "all six coordinates, without the governor": Case(SIX, (SHORT, UNGOVERNED)),
    "on the MuJoCo plant": Case(PAST, ("duration=20",), plant="mujoco"),
}
AT_FOUR_METRES = {
    "worst case, 4 m": Case(DEEP, (SHORT,)),
    "worst case, 4 m, the whole 200 s": Case(DEEP),
    "worst case, 4 m, 200 s, tensions wanted from 0.3 N, planned from 0.5 N": Case(
        DEEP, (LOWER, "control.motion.governor={preview: 1.0, reserve: 0.2}")
    ),
    "worst case, 4 m, 200 s, tensions wanted from 0.3 N, planned from 0.8 N": Case(
        DEEP, (LOWER, "control.motion.governor={preview: 1.0, reserve: 0.5}")
    ),
    "worst case, 4 m, as at 2 m": Case(PAST, (SHORT, FOUR_METRES)),
    "worst case, 4 m, without the governor": Case(PAST, (SHORT, FOUR_METRES, UNGOVERNED)),
}
# In the calm sea, about mean places x y z φ θ ψ of the target [m, rad], as far out as the bar can
# rest with the test-bed's lower limits, from where a run starts.
PLACES = {
    "up, z = 1 m": [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
    "down, z = 4 m": [0.0, 0.0, 4.0, 0.0, 0.0, 0.0],
    "x = y = 0.09 m": [0.09, 0.09, 2.0, 0.0, 0.0, 0.0],
    "x = y = −0.09 m, z = 4 m": [-0.09, -0.09, 4.0, 0.0, 0.0, 0.0],
    "pitch 0.8 rad": [0.0, 0.0, 2.0, 0.0, 0.8, 0.0],
    "yaw 0.5 rad": [0.0, 0.0, 2.0, 0.0, 0.0, 0.5],
    "x = y = 0.06 m, pitch 0.5, yaw 0.3 rad": [0.06, 0.06, 2.0, 0.0, 0.5, 0.3],
}
CORNERS = {
    name: Case("calm_broadband", ("duration=20", PAST_ON_CALM, f"target.mean_pose={place}"))
    for name, place in PLACES.items()
}
# The same places in the worst case's sea, scaled to as many tenths as leave the reference possible
# with tensions from 0.3 N on at each fifth of a second.
AMPLITUDES = {
    "target": (0.1105, 0.0865, 0.318, 0.027, 0.2164, 0.1068),
    "winch_frame": (0.0188, 0.0088, 0.0248, 0.0067, 0.0065, 0.0033),
}


def waves(share: float) -> tuple[str, ...]:
    """Return what makes the waves of the worst case a share of themselves."""
    return tuple(
        f"{body}.motion.amplitudes={[round(share * each, 6) for each in amplitudes]}"
        for body, amplitudes in AMPLITUDES.items()
    )


ROUGH_CORNERS = {
    f"{name}, waves × {tenths / 10:g}": Case(
        PAST, (SHORT, f"target.mean_pose={place}", *waves(tenths / 10))
    )
    for (name, place), tenths in zip(PLACES.items(), (10, 3, 3, 1, 7, 5, 4), strict=True)
}
# As above, but with the force controllers designed where the bar is instead of at 2 m. Where the
# bar hangs aside at 4 m none can be designed with the bandwidth.
DESIGNED_THERE = {
    name: replace(case, overrides=(*case.overrides, f"control.motion.design_pose={place}"))
    for (name, case), place in zip(ROUGH_CORNERS.items(), PLACES.values(), strict=True)
    if place != [-0.09, -0.09, 4.0, 0.0, 0.0, 0.0]
}
LIMITED = {
    "worst case": Case("worst_case_steep"),
    "worst case, all six coordinates": Case(SIX),
    "worst case, 4 m": Case("worst_case_steep_4m"),
    "worst case, read literally": Case("worst_case_literal"),
    "calm": Case("calm_broadband", ("duration=200",)),
    BLOWN: Case(PAST, (ROBUST, KNOWN_WIND)),
}
ROUGHEST = "worst case, all six coordinates, seed 9"
# Cases and the lower limits of tension [N] for which the least error is computed.
POSSIBLE: dict[str, tuple[Case, float]] = {
    "worst case": (LIMITED["worst case"], 0.0),
    "worst case, all six coordinates": (LIMITED["worst case, all six coordinates"], 0.0),
    ROUGHEST: (Case(SIX, ("seed=9",)), 0.0),
    f"{ROUGHEST}, tensions from 0.7 N on": (Case(SIX, ("seed=9",)), 0.7),
    "worst case, 4 m": (LIMITED["worst case, 4 m"], 0.0),
    "worst case, 4 m, tensions from 0.5 N on": (LIMITED["worst case, 4 m"], 0.5),
    "worst case, 4 m, tensions from 0.6 N on": (LIMITED["worst case, 4 m"], 0.6),
    "worst case, 4 m, tensions from 0.8 N on": (LIMITED["worst case, 4 m"], 0.8),
    BLOWN: (LIMITED[BLOWN], 0.0),
    f"{BLOWN}, tensions from 0.5 N on": (LIMITED[BLOWN], 0.5),
}
# Seeds with all six coordinates, and lower limits of tension [N]: none, what is wanted, planned.
POSSIBLE_SIX = {f"seed {seed}": Case(SIX, (f"seed={seed}",)) for seed in (1, 9, 14)}
POSSIBLE_LOWER = (0.0, 0.3, 0.7)


def seeded(seeds: int, profile: tuple[str, ...], scenario: str = PAST) -> dict[str, Case]:
    """Return a worst case with each of so many seeds and one motion capture."""
    return {
        f"seed {seed}": Case(scenario, (f"seed={seed}", *profile)) for seed in range(1, seeds + 1)
    }


def calm(seeds: int) -> dict[str, Case]:
    """Return the calm sea past the thesis, with each motion capture and of so many seeds."""
    return {
        f"{profile}, {name}": case
        for profile, rates in PROFILES.items()
        for name, case in seeded(seeds, (*TENTH, *rates), "calm_broadband").items()
    }
