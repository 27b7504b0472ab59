"""The runs of results/steep-sea.md on machines that controllers are wrong about."""

from __future__ import annotations

from bench.results.result_cases import CAMERA_100_HZ, HALF, KNOWN_WIND, PAST, ROBUST, SIX
from bench.results.result_winch_cases import AHEAD, rubbing
from bench.results.tracking import Case, Effects

WIND = {"surge": 1.0, "sway": 2.0, "heave": 0.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.0}
CHANGES: dict[str, Effects] = {
    "nothing": (),
    "cable stiffness +20 %": (("cable_stiffness", (), {"scale": 1.2}),),
    "cable stiffness −20 %": (("cable_stiffness", (), {"scale": 0.8}),),
    "cable damping +20 %": (("cable_axial_damping", (), {"scale": 1.2}),),
    "cable damping −20 %": (("cable_axial_damping", (), {"scale": 0.8}),),
    "bar's mass +20 %": (("bar_mass", (), {"mass": 0.812}),),
    "bar's mass −20 %": (("bar_mass", (), {"mass": -0.812}),),
    "poses 5 ms late": (("pose_delay", (), {"delay": 0.005}),),
    "load cell of surge_1 +0.2 N": (("tension_bias", ("surge_1",), {"bias": 0.2}),),
    "load cell of surge_1 +1 N": (("tension_bias", ("surge_1",), {"bias": 1.0}),),
    "hoist_1's drive at half torque": (("winch_torque_gain", ("hoist_1",), {"gain": 0.5}),),
    "wind of 2 N in sway and 1 N in surge": (("bar_constant_wrench", (), WIND),),
}
FRICTION_CHANGES = {"friction as described": 1.0, "friction +20 %": 1.2, "friction −20 %": 0.8}
SURGE, SWAY, HOIST = ("surge_1",), ("sway_1",), ("hoist_1",)
CORRECTED: dict[str, Effects] = {
    "nothing": (),
    "load cell of surge_1 +1 N": (("tension_bias", SURGE, {"bias": 1.0}),),
    "load cell of sway_1 −1 N": (("tension_bias", SWAY, {"bias": -1.0}),),
    "load cell of hoist_1 +1 N": (("tension_bias", HOIST, {"bias": 1.0}),),
    "all load cells +1 N, dry friction 2 mN·m at every motor": (
        ("tension_bias", (), {"bias": 1.0}),
        ("winch_coulomb_friction", (), {"torque": 0.002}),
    ),
    "hoist_1's drive at half torque": (("winch_torque_gain", HOIST, {"gain": 0.5}),),
}
# What the machine has and its controllers know, by the test-bed's file or by the scenario.
INFORMED = {
    "poses 5 ms late": Case(PAST, (ROBUST,), pose_delay=0.005),
    "wind of 2 N in sway and 1 N in surge": Case(
        PAST, (ROBUST, KNOWN_WIND), (("bar_constant_wrench", (), WIND),)
    ),
}
ESTIMATED = "control.force.load_cell_bias={largest: 2.0}"
HEAVY: Effects = (("bar_mass", (), {"mass": 0.812}),)
LIGHT: Effects = (("bar_mass", (), {"mass": -0.812}),)
PULLED: Effects = (
    (
        "bar_constant_wrench",
        (),
        {"surge": 0.0, "sway": 0.0, "heave": 4.0, "roll": 0.0, "pitch": 0.0, "yaw": 0.0},
    ),
)
MASSES = {
    "nothing": Case(PAST, (HALF,)),
    "bar's mass +20 %": Case(PAST, (HALF,), HEAVY),
    "bar's mass −20 %": Case(PAST, (HALF,), LIGHT),
    "bar's mass +20 %, 100 Hz": Case(PAST, (HALF, *CAMERA_100_HZ), HEAVY),
    "bar's mass +20 %, all six coordinates": Case(SIX, (HALF,), HEAVY),
    "steady force of 4 N downwards": Case(PAST, (HALF,), PULLED),
}
LOAD = 0.812
SWINGING = {
    name: (("payload_swing", (), {"mass": mass, "length": length, "damping": 0.05}),)
    for name, mass, length in (
        ("0.1 kg swinging 0.3 m below", 0.1, 0.3),
        ("0.4 kg swinging 0.3 m below", 0.4, 0.3),
        ("0.8 kg swinging 1 m below", LOAD, 1.0),
    )
}
PAYLOADS = {
    "0.8 kg taken up at 50 s": Case(PAST, (HALF,), loads=((50.0, LOAD),)),
    "0.8 kg taken up at 50 s, 100 Hz": Case(PAST, (HALF, *CAMERA_100_HZ), loads=((50.0, LOAD),)),
    "0.8 kg taken up at 30 s, set down at 70 s": Case(
        PAST, (HALF,), loads=((30.0, LOAD), (70.0, -LOAD))
    ),
    **{name: Case(PAST, (HALF,), swinging) for name, swinging in SWINGING.items()},
}
ADAPTED = "control.motion.mass_adaptation={}"


def corrected() -> dict[str, Case]:
    """Return the worst case past the thesis with load cells that are off, and corrected."""
    return {name: Case(PAST, (ROBUST, ESTIMATED), effects) for name, effects in CORRECTED.items()}


def changed(scenario: str) -> dict[str, Case]:
    """Return a scenario on machines that are not what the controllers think."""
    cases = {name: Case(scenario, (ROBUST,), effects) for name, effects in CHANGES.items()}
    for name, share in FRICTION_CHANGES.items():
        cases[name] = Case(scenario, (ROBUST, AHEAD), rubbing(share), reported=rubbing(1.0))
    return cases
