"""The same data in other units: the same effect, with a parameter in proportion."""

import io
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from machines import LINEAR, rig_content
from ruamel.yaml import YAML

from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.residuals.machine_scales import (
    CATALOGUE_SCALES,
    Scales,
    scaled,
    scales_of,
)
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.testbed import parse_testbed
from cspm_sim.effects import catalogue

RATE, SECONDS = 500.0, 20.0


def in_units(content, force=1.0, length=1.0, gear=1.0):
    """A rig's file with forces and lengths in other units, and its shaft's angle over `gear`."""
    (winch,) = content["cables"]
    scaled_winch = {
        **winch,
        "exit": [length * x for x in winch["exit"]],
        "attachment": [length * x for x in winch["attachment"]],
        "offset_length": length * winch["offset_length"],
        "stiffness": {
            **LINEAR,
            "youngs_modulus": force / length**2 * LINEAR["youngs_modulus"],
            "diameter": length * LINEAR["diameter"],
            "floor_tension": force * LINEAR["floor_tension"],
        },
        "damping": {"constant": 20.0 * force / length, "slope": 1.5 * force / length**2},
        "drum_radius": length * winch["drum_radius"],
        "gear_ratio": 1.0 / gear,
        "rotor_inertia": force * length * gear**2 * winch["rotor_inertia"],
        "torque_limit": force * length * gear * winch["torque_limit"],
        "tension_limits": [0.0, 60.0 * force],
    }
    return {**content, "cables": [scaled_winch]}


def text_of(content):
    stream = io.StringIO()
    YAML().dump(content, stream)
    return stream.getvalue()


def measured(resisting, force=1.0, length=1.0, gear=1.0):
    """A winch that turns to and fro under a constant pull, its drive against some resistance."""
    rng = np.random.default_rng(6)
    times = np.arange(0.0, SECONDS, 1.0 / RATE)
    speeds = sum(a * np.cos(w * times + p) for a, w, p in ((3, 1.3, 0), (2, 3.1, 1), (4, 0.7, 2)))
    angles = np.concatenate([[0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) / RATE)])
    content = in_units(rig_content(), force, length, gear)
    inertia, radius = rig_content()["cables"][0]["rotor_inertia"], 0.025
    tension = 20.0 + 12.0 * np.sin(2.0 * times) + 0.01 * rng.standard_normal(len(times))
    torque = radius * tension + inertia * np.gradient(speeds, times) + resisting(speeds, angles)
    torque = torque + 1e-4 * rng.standard_normal(len(times))
    samples = {
        "angle": angles / gear,
        "torque": torque * gear * force * length,
        "tension": tension * force,
    }
    return Measurement(
        "rig",
        "ab" * 32,
        parse_testbed(text_of(content), "rig.yaml"),
        **{name: Samples(times, values[:, None]) for name, values in samples.items()},
    )


# Lengths within what a file may have: one a thousand times as long is refused as a wrong unit.
UNITS = [
    {"force": 1e3},
    {"force": 1e-3},
    {"length": 20.0},
    {"length": 0.05},
    {"force": 1e3, "length": 20.0},
    {"force": 1e-3, "length": 0.05},
    {"gear": 100.0},
    {"gear": 1e-2},
]
CASES = {
    "winch_coulomb_friction": (lambda v, q: 0.03 * np.sign(v), "torque", 0.03, 1),
    "winch_viscous_friction": (lambda v, q: 0.005 * v, "coefficient", 0.005, 2),
    "winch_inertia": (lambda v, q: 1e-3 * np.gradient(v) * RATE, "inertia", 1e-3, 2),
}


@cache
def usual(name):
    return diagnose([measured(CASES[name][0])])


@pytest.mark.parametrize("units", UNITS, ids=str)
@pytest.mark.parametrize("name", CASES)
def test_the_same_data_in_other_units_give_the_same_verdict(name, units):
    resisting, parameter, value, gears = CASES[name]
    found = diagnose([measured(resisting, **units)])
    assert [each.effect for each in usual(name).reported] == [name]
    assert [each.effect for each in found.reported] == [name]
    torque = units.get("force", 1.0) * units.get("length", 1.0) * units.get("gear", 1.0) ** gears
    (own,) = (p for p in found.reported[0].parameters if p.name == parameter)
    (plain,) = (p for p in usual(name).reported[0].parameters if p.name == parameter)
    assert plain.value == pytest.approx(value, rel=0.02)
    assert own.value == pytest.approx(torque * plain.value, rel=1e-3)


def test_stribeck_speeds_are_looked_for_where_the_shaft_turns():
    """At the joint the shaft turns a hundredth as fast, under a hundred times the torque."""
    effect, still = catalogue()["winch_stribeck_friction"], lambda v, q: 0.02 * np.sign(v)
    motor, joint = (scales_of([measured(still, gear=gear)]) for gear in (1.0, 100.0))
    assert joint.speed == pytest.approx(motor.speed / 100.0)
    assert joint.torque == pytest.approx(100.0 * motor.torque)
    at_motor, at_joint = (scaled(effect, s).signature.nonlinear for s in (motor, joint))
    assert at_joint["stribeck_speed"] == pytest.approx(
        [v / 100.0 for v in at_motor["stribeck_speed"]]
    )


def test_ranges_and_grids_follow_by_powers_of_ten():
    effect = catalogue()["winch_stribeck_friction"]
    larger = scaled(effect, CATALOGUE_SCALES._replace(torque=40.0, speed=10.0))
    assert [p.maximum for p in larger.parameters] == pytest.approx([100.0, 100.0, 100.0])
    assert larger.signature.nonlinear["stribeck_speed"] == pytest.approx(
        [0.1 * v for v in effect.signature.nonlinear["stribeck_speed"]]
    )
    assert scaled(effect, CATALOGUE_SCALES) is effect
    near = Scales(*(2.5 * size for size in CATALOGUE_SCALES))
    assert scaled(effect, near) is effect


def test_every_dimension_follows_what_it_is_made_of():
    """Independent road: a unit's powers, from torque = force·length and the second as it is."""
    ten = CATALOGUE_SCALES._replace(force=150.0, length=200.0)
    powers = {"N": 10.0, "m": 100.0, "m/N": 10.0, "N·s/m": 0.1, "kg": 0.1, "kg/m": 1e-3, "N·m": 1e3}
    seen = set()
    for effect in catalogue().values():
        if effect.block.value == "winch":
            continue
        for old, new in zip(effect.parameters, scaled(effect, ten).parameters, strict=True):
            if old.unit in powers:
                seen.add(old.unit)
                assert new.maximum == pytest.approx(powers[old.unit] * old.maximum), effect.id
    assert seen == set(powers)


def test_without_signals_the_ranges_are_the_catalogues():
    rig = measured(lambda v, q: 0.0 * v)
    none = replace(rig, angle=None, torque=None, tension=None)
    found = scales_of([none])
    assert found[:3] == CATALOGUE_SCALES[:3]
    assert found.length == pytest.approx(2.1)
