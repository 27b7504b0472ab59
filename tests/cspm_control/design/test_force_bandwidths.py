"""Force loops that are tuned apart: which cable gets which bandwidth; the slowest rules."""

import numpy as np
import pytest
from run_samples import THESIS_CABLES, bundle_of

from cspm.analysis.design import analyze_design, gain_groups
from cspm.commands.analysis.analyze_design_command import analyze_design_command
from cspm_control.design.force_gains import design_force_gains
from cspm_control.design.gains import force_margins, motion_margins
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.control_spec.force import PiGains
from cspm_msgs_py.control_spec.per_cable import values_per_cable
from cspm_msgs_py.errors import InputError

THESIS = bundle_of("rest").testbed.testbed
PARAMETERS = nominal_parameters(THESIS)
CENTRE = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)
KEY = "control.force.bandwidth"
NAMES = ("hoist_1", "hoist_2", "surge_1", "left")


@pytest.mark.parametrize(
    ("given", "values"),
    [
        (7.0, (7.0, 7.0, 7.0, 7.0)),
        ({}, (1.0, 1.0, 1.0, 1.0)),
        ({"hoist": 7.0}, (7.0, 7.0, 1.0, 1.0)),
        ({"hoist": 7.0, "hoist_2": 5.0}, (7.0, 5.0, 1.0, 1.0)),
        ({"hoist_2": 5.0, "hoist": 7.0}, (7.0, 5.0, 1.0, 1.0)),
        ({"left": 3.0, "surge_1": 2.0}, (1.0, 1.0, 2.0, 3.0)),
    ],
)
def test_a_cables_own_name_goes_before_its_kind_and_the_default_last(given, values):
    assert values_per_cable(given, NAMES, 1.0, "key") == values


def test_a_name_that_is_no_cable_is_refused_in_one_line():
    with pytest.raises(InputError) as caught:
        values_per_cable({"hoist": 1.0, "hoist_3": 2.0}, NAMES, 1.0, "key")
    assert str(caught.value) == (
        "key: hoist_3, allowed: hoist, surge, left, hoist_1, hoist_2, surge_1; did you mean"
        " hoist_2, hoist_1 or hoist?"
    )


def test_each_cables_loop_has_the_bandwidth_that_it_was_given():
    gains = design_force_gains(THESIS, PARAMETERS, CENTRE, {"hoist": 400.0, "sway_3": 900.0})
    assert tuple(gains) == THESIS_CABLES
    found = force_margins(THESIS, PARAMETERS, CENTRE, gains)
    expected = [400.0, 400.0, 800.0, 800.0, 800.0, 800.0, 900.0, 800.0]
    np.testing.assert_allclose([found[n].bandwidth for n in THESIS_CABLES], expected, rtol=1e-6)


def test_who_is_not_named_is_tuned_as_if_nobody_was():
    all_alike = design_force_gains(THESIS, PARAMETERS, CENTRE, 800.0)
    others = design_force_gains(THESIS, PARAMETERS, CENTRE, {"hoist": 400.0})
    same = {name for name in THESIS_CABLES if others[name] == all_alike[name]}
    assert same == set(THESIS_CABLES) - {"hoist_1", "hoist_2"}
    # The gain at the gear's slow side falls with the bandwidth, and so does integral action.
    assert others["hoist_1"].kp < 0.7 * all_alike["hoist_1"].kp
    assert others["hoist_1"].integral_frequency == pytest.approx(20.0)


def test_the_motion_loops_are_a_tenth_of_the_slowest_force_loop():
    control = bundle_of("rest", KEY + "={hoist: 200}").scenario.control
    found = motion_margins(THESIS, PARAMETERS, CENTRE, control.motion.gains)
    usual = bundle_of("rest").scenario.control.motion.gains
    widest = motion_margins(THESIS, PARAMETERS, CENTRE, usual)
    assert max(loop.bandwidth for loop in widest.values()) > 22.0
    assert 15.0 < max(loop.bandwidth for loop in found.values()) <= 20.0 * (1.0 + 1e-3)


def test_a_slow_cable_is_named_where_crossovers_are_wanted():
    with pytest.raises(InputError) as caught:
        bundle_of("rest", KEY + "={surge_2: 300}", "control.motion.crossover={surge: 30}")
    line = str(caught.value)
    assert line.startswith("control.force: surge_2 has a bandwidth of 300 rad/s, allowed: at least")
    bundle_of("rest", KEY + "={surge_2: 300}", "control.motion.crossover={surge: 12}")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("{hoist: 1200}", f"{KEY}: 1200 rad/s of hoist_1, allowed: above 0 and at most 1000 rad/s"),
        ("1200", f"{KEY}: 1200 rad/s, allowed: above 0 and at most 1000 rad/s"),
        ("{heave: 400}", f"{KEY}: heave, allowed: hoist, surge, sway, hoist_1, hoist_2, surge_1,"),
        ("{hoist: -5}", f"{KEY}.hoist: -5, allowed: greater than 0"),
        ("{hoist: fast}", f"{KEY}.hoist: 'fast', allowed: a number"),
        ("fast", f"{KEY}: 'fast', allowed: a number"),
        ("{sway: 100}", f"{KEY}: at 100 rad/s the loop of sway_1 already falls below −3 dB at"),
    ],
)
def test_each_fault_is_one_line(value, text):
    with pytest.raises(InputError) as caught:
        bundle_of("rest", f"{KEY}={value}")
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


def test_cables_of_a_kind_with_other_gains_stand_by_themselves():
    slow, fast = PiGains(kp=1.0, integral_frequency=9.0), PiGains(kp=2.0, integral_frequency=9.0)
    lazy = PiGains(kp=1.0, integral_frequency=8.0)
    gains = {"hoist_1": slow, "hoist_2": fast, "surge_1": slow, "left": slow}
    assert gain_groups(NAMES, gains) == {
        "hoist": "hoist_1",
        "hoist_2": "hoist_2",
        "surge": "surge_1",
        "left": "left",
    }
    assert set(gain_groups(NAMES, gains | {"hoist_2": slow})) == {"hoist", "surge", "left"}
    assert "hoist_2" in gain_groups(NAMES, gains | {"hoist_2": lazy})


@pytest.mark.compiled
def test_analyze_design_shows_each_bandwidth(capsys, tmp_path):
    path = tmp_path / "slow_hoist.yaml"
    path.write_text(
        f"name: slow_hoist\ntestbed: {bundle_of('rest').testbed.source}\nduration: 1.0\n"
        "control: {mode: closed_loop, force: {bandwidth: {hoist: 400, hoist_2: 600}}}\n"
    )
    design = analyze_design(path)
    assert design.groups == {
        "hoist": "hoist_1",
        "hoist_2": "hoist_2",
        "surge": "surge_1",
        "sway": "sway_1",
    }
    found = design.data()["force"]["designed"]
    expected = {"hoist_1": 400.0, "hoist_2": 600.0, "surge_1": 800.0, "sway_4": 800.0}
    for name, bandwidth in expected.items():
        assert found[name]["bandwidth"] == pytest.approx(bandwidth, rel=1e-3)
    analyze_design_command(design.machine, None, None, None)
    shown = capsys.readouterr().out
    assert "hoist cables" in shown
    assert "hoist_2" in shown
