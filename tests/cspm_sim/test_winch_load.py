"""A winch that lifts a known mass, and one whose load depends on its angle."""

from pathlib import Path

import numpy as np
import pytest

from cspm_ident.diagnosis.residuals.corrected_measurement import settled
from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_ident.winch.identify_winches import identify_winches
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import parse_testbed
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects.signals import WinchSignal
from cspm_sim.mujoco.extras import find_extras
from cspm_sim.parameters import plant_parameters

MASS, MOMENT, ANGLE = 5.0, 0.4, 0.7
RADIUS, GEAR, GRAVITY, ROTOR = 0.02, 2.0, 9.81, 2.0e-4
TESTBED = f"""
name: lift
cables:
  - name: w
    drum_radius: {RADIUS}
    gear_ratio: {GEAR}
    rotor_inertia: {ROTOR}
    torque_limit: 3.0
    load: {{LOAD}}
sensors:
  /winches/state: {{{{noise: [0.0, 0.05, 0.001], resolution: [7.7e-4, 0.0, 0.0], rate: 1000}}}}
effects:
  - {{{{effect: winch_coulomb_friction, elements: [w], parameters: {{{{torque: 0.06}}}}}}}}
"""
SCENARIO = """
name: lift
testbed: lift.yaml
duration: 12.0
seed: 1
control:
  mode: torque
  torque:
    w:
      offset: 0.4905
      sines:
        - {amplitude: 0.5, frequency: 0.7}
        - {amplitude: 0.3, frequency: 1.9, phase: 1.0}
"""
BOTH = f"{{mass: {MASS}, moment: {MOMENT}, angle: {ANGLE}}}"


def machine_file(load=BOTH):
    return parse_testbed(TESTBED.replace("{LOAD}", load).replace("{{", "{").replace("}}", "}"), "t")


def resistance(testbed, angle):
    """Torque of the load at the shaft by the effects' own columns, at rest [N·m]."""
    rows = np.zeros((1, 32))
    rows[0, WinchSignal.ANGLE], rows[0, WinchSignal.GEAR] = angle, GEAR
    total = 0.0
    for action in read_actions(testbed):
        if action.effect.physics.alter is None and action.effect.id != "winch_coulomb_friction":
            shape = {name: action.values[name] for name in action.effect.signature.nonlinear}
            columns = action.effect.regressors(rows, **shape)[0, 0]
            total += float(columns @ np.asarray(action.effect.weights(action.values)))
    return total


@pytest.mark.parametrize("angle", [0.0, 1.0, -4.0])
def test_gravity_resists_winding(angle):
    testbed = machine_file().testbed
    drum = angle / GEAR
    by_hand = MASS * GRAVITY * RADIUS / GEAR + MOMENT / GEAR * np.cos(drum - ANGLE)
    assert resistance(testbed, angle) == pytest.approx(by_hand, rel=1e-12)


def test_a_mass_is_an_inertia_at_the_shaft():
    row = plant_parameters(machine_file("{mass: 5.0}").testbed).cables[0]
    assert ROTOR + MASS * (RADIUS / GEAR) ** 2 in row
    assert ROTOR in plant_parameters(machine_file("{moment: 0.4}").testbed).cables[0]


@pytest.mark.slow
def test_a_known_load_is_no_finding_of_its_winch(cspm, tmp_path):
    (tmp_path / "lift.yaml").write_text(machine_file().text, encoding="utf-8")
    (tmp_path / "scenario.yaml").write_text(SCENARIO, encoding="utf-8")
    assert cspm("run", "scenario.yaml", "--out", "lift")[0] == 0
    measurement = read_measurement(tmp_path / "lift")
    (winch,) = identify_winches([measurement], torque_age=measurement.torque_age).winches
    estimate = winch.fit.estimate
    for name, truth in (("inertia", ROTOR), ("winch_coulomb_friction torque", 0.06)):
        assert estimate.value(name) == pytest.approx(truth, rel=0.01)
    assert "winch_torque_offset torque" in winch.unseen
    assert winch.judgements[0].errors["described"].percent < 1.0
    heavier = machine_file(BOTH.replace("5.0", "5.5"))
    (other,) = identify_winches(
        [measurement.with_testbed(heavier)], torque_age=measurement.torque_age
    ).winches
    missing = other.fit.estimate.value("winch_torque_offset torque")
    assert missing == pytest.approx(0.5 * GRAVITY * RADIUS / GEAR, rel=0.02)
    code, out, _ = cspm("diagnose", "lift")
    assert (code, "verdict: consistent" in out) == (0, True)


def test_a_corrected_machine_has_its_load_once():
    """Corrections write effects out; the load is then no more among the cable's numbers."""
    file = machine_file()
    measurement = settled(_measurement(file))
    assert resistance(measurement.machine, 1.0) == pytest.approx(resistance(file.testbed, 1.0))
    inertia = ROTOR + MASS * (RADIUS / GEAR) ** 2
    assert measurement.machine.cables[0].rotor_inertia == pytest.approx(inertia)


def _measurement(file):
    return Measurement(Path("some"), "", file)


@pytest.mark.parametrize(
    ("load", "words"),
    [
        ("{}", "neither mass nor moment, allowed: one of them or both"),
        ("{mass: 5.0, angle: 0.3}", "angle without moment, allowed: with moment"),
        ("{mass: -5.0}", "greater than 0"),
        ("{weight: 5.0}", "weight: unknown key"),
    ],
)
def test_a_load_that_is_none_is_refused(load, words):
    with pytest.raises(InputError, match=words) as caught:
        machine_file(load)
    assert "\n" not in str(caught.value)


def test_a_cable_has_no_load_of_its_own():
    text = """
name: rig
cables:
  - {name: w, exit: [0, 0, 0], attachment: [0, 0, 1], tension_limits: [1, 40], drum_radius: 0.02,
     stiffness: {law: linear, youngs_modulus: 5.0e+9, diameter: 1.0e-3, floor_tension: 0.05},
     damping: {constant: 1.0}, rotor_inertia: 2.0e-4, torque_limit: 3.0, load: {mass: 5.0}}
"""
    with pytest.raises(InputError, match="load: of w, whose cable carries what its attachment"):
        parse_testbed(text, "t")


def test_the_other_plant_refuses_a_load():
    with pytest.raises(InputError, match=r"^load: of w: not in the MuJoCo plant, allowed: none$"):
        find_extras(machine_file().testbed)
