"""The runs behind results/steep-sea.md that are about friction and winches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from bench.results.result_cases import CAMERA_100_HZ, PAST, SHORT, SIX
from bench.results.tracking import SCENARIOS, Case, Effects
from cspm_msgs_py.testbed import load_testbed

# Dry friction [N·m] and viscous friction [N·m·s/rad] of every motor, and dry friction as a share of
# the load's torque.
DRY_10: Effects = (("winch_coulomb_friction", (), {"torque": 0.01}),)
DRY_30: Effects = (("winch_coulomb_friction", (), {"torque": 0.03}),)
VISCOUS: Effects = (("winch_viscous_friction", (), {"coefficient": 1e-4}),)
OF_LOAD: Effects = (("winch_load_friction", (), {"coefficient": 0.2}),)
SLOW_FORCE = "control.force.bandwidth=200"
FRICTION = {
    "dry friction 10 mN·m": Case(PAST, (SHORT,), DRY_10),
    "dry friction 30 mN·m": Case(PAST, (SHORT,), DRY_30),
    "dry friction 30 mN·m, 100 Hz": Case(PAST, (SHORT, *CAMERA_100_HZ), DRY_30),
    "dry friction 20 % of the load": Case(PAST, (SHORT,), OF_LOAD),
    "dry friction 10 mN·m, viscous 0.1 mN·m·s": Case(PAST, (SHORT,), DRY_10 + VISCOUS),
    "dry friction 10 mN·m, force controllers at 200 rad/s": Case(PAST, (SHORT, SLOW_FORCE), DRY_10),
    "dry friction 10 mN·m, the thesis's controllers": Case("worst_case_steep", (SHORT,), DRY_10),
}
AHEAD = "control.force.friction_feedforward={}"
# What is left of stiffness and damping of cables that are 4 times softer. With a quarter of the
# damping no force controllers can be designed with the thesis's margins.
SOFT = (0.25, 0.5)
SLOW = (SHORT, SLOW_FORCE)
WINCHES = {
    "worst case": Case(PAST, (SHORT,)),
    "100 Hz": Case(PAST, (SHORT, *CAMERA_100_HZ)),
    "cables 4 times softer": Case(PAST, (SHORT,), cables=SOFT),
    "force controllers at 200 rad/s": Case(PAST, SLOW),
    "200 rad/s, 100 Hz": Case(PAST, (*SLOW, *CAMERA_100_HZ)),
    "200 rad/s, cables 4 times softer": Case(PAST, SLOW, cables=SOFT),
    "200 rad/s, dry friction 10 mN·m as described": Case(PAST, (*SLOW, AHEAD), DRY_10),
    "all six coordinates": Case(SIX, (SHORT,)),
    "the thesis's controllers": Case("worst_case_steep", (SHORT,)),
}
WINCH_AHEAD = {
    "fed forward": "control.force.winch_feedforward={}",
    "and stretch": "control.force.winch_feedforward={stretch_bandwidth: 200.0}",
}


def rubbing(share: float) -> Effects:
    """Return both frictions of every motor, as a share of 10 mN·m and 0.1 mN·m·s."""
    return (
        ("winch_coulomb_friction", (), {"torque": share * 0.01}),
        ("winch_viscous_friction", (), {"coefficient": share * 1e-4}),
    )


def with_and_without(cases: Mapping[str, Case], option: str, said: str) -> dict[str, Case]:
    """Return each case, and after it the same with an option."""
    found = {}
    for name, case in cases.items():
        found[name] = case
        found[f"{name}, {said}"] = replace(case, overrides=(*case.overrides, option))
    return found


def heavier_rotors(share: float) -> Effects:
    """Return what makes every winch's inertia more by a share of itself."""
    testbed = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml").testbed
    return tuple(
        ("winch_inertia", (cable.name,), {"inertia": share * cable.rotor_inertia})
        for cable in testbed.cables
    )


def wound() -> dict[str, Case]:
    """Return each case of the winches, without and with what can go ahead of them."""
    heavier = {"200 rad/s, rotors' inertia +20 %": Case(PAST, SLOW, heavier_rotors(0.2))}
    found = {}
    for name, case in (WINCHES | heavier).items():
        found[name] = case
        for said, option in WINCH_AHEAD.items():
            found[f"{name}, {said}"] = replace(case, overrides=(*case.overrides, option))
    return found
