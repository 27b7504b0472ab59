"""Test-beds and scenarios by name, changed in one call."""

import pytest
from machines import THESIS

import cspm
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.library import find_scenario


@pytest.fixture(scope="module")
def thesis():
    return cspm.load_testbed("thesis")


def test_a_test_bed_comes_by_name_and_by_path(thesis):
    assert thesis.text == THESIS.read_text(encoding="utf-8")
    assert cspm.load_testbed(THESIS).sha256 == load_testbed(THESIS).sha256 == thesis.sha256
    assert thesis.name == "thesis"
    assert thesis.cables[-1] == "sway_4"


def test_a_planted_effect_is_in_description_text_and_hash(thesis):
    worn = thesis.with_effect("winch_coulomb_friction", "sway_3", "sway_4", torque=0.03)
    assert worn.effects[:-1] == thesis.effects
    assert worn.effects[-1].elements == ("sway_3", "sway_4")
    assert "winch_coulomb_friction" in worn.text
    assert worn.sha256 != thesis.sha256
    assert worn.without_effect("winch_coulomb_friction").description == thesis.description


def test_a_saved_test_bed_is_loaded_again(thesis, tmp_path):
    heavy = thesis.with_parameter("bar.mass", 5.2)
    path = heavy.save(tmp_path / "heavy.yaml")
    assert cspm.load_testbed(path).sha256 == heavy.sha256
    with pytest.raises(cspm.InputError, match=r"heavy.yaml: already exists, allowed: a new file"):
        heavy.save(path)
    with pytest.raises(cspm.InputError, match=r"cannot be written \(No such file"):
        heavy.save(tmp_path / "nowhere" / "heavy.yaml")


def test_a_testbed_shows_itself_in_a_line():
    found = repr(cspm.load_testbed("thesis"))
    assert found == "Testbed('thesis', 8 cables, effects: bar_linear_damping)"
    assert repr(cspm.load_testbed("one_winch")) == "Testbed('one_winch', 1 cable, effects: none)"


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda t: t.with_effect("winch_rust", torque=1.0), "no such effect, allowed: bar_com, "),
        (
            lambda t: t.with_effect("winch_coulomb_friction", "sway_9", torque=0.03),
            "effects: winch_coulomb_friction: no element 'sway_9', allowed: hoist_1,",
        ),
        (
            lambda t: t.with_effect("winch_coulomb_friction", "sway_3", torque=-1.0),
            r"torque = -1 N·m, allowed: 0 to",
        ),
        (
            lambda t: t.with_effect("winch_coulomb_friction", "sway_3", torque="much"),
            "torque = 'much', allowed: a number",
        ),
        (lambda t: t.with_parameter("bar.mass", -1), "bar.mass: -1, allowed: greater than 0"),
        (lambda t: cspm.load_testbed("thesys"), "thesys: no such test-bed, allowed: cogiro, "),
        (lambda t: cspm.load_testbed("thesys.yaml"), "no such file, allowed: a test-bed file"),
    ],
)
def test_what_is_no_machine_is_refused_in_one_line(thesis, change, line):
    with pytest.raises(cspm.InputError, match=line) as caught:
        change(thesis)
    assert "\n" not in str(caught.value)


def test_a_scenario_changes_as_by_the_command_line():
    changed = cspm.load_scenario("calm").with_parameter("seed", 3)
    changed = changed.with_parameter("rates.motion_controller", 100)
    path = find_scenario("calm")
    assert changed.path == path
    assert changed.description == load_scenario(path, ["seed=3", "rates.motion_controller=100"])
    assert changed.testbed.name == "thesis_refitted"
    assert cspm.load_scenario(path).description == load_scenario(path)


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("durations", 3, "durations: unknown key, allowed: name, description"),
        ("duration", -3, "duration: -3, allowed: greater than 0"),
        ("duration", float("nan"), "duration: nan, allowed: a finite number, a text, or lists"),
        ("duration", object(), "allowed: a finite number, a text, or lists and mappings"),
        ("a=b", 3, "a=b: allowed: a key path, such as control.motion.crossover.surge"),
    ],
)
def test_what_is_no_scenario_is_refused_in_one_line(key, value, line):
    with pytest.raises(cspm.InputError, match=line):
        cspm.load_scenario("calm").with_parameter(key, value)


def test_a_scenario_that_is_not_there_is_refused():
    with pytest.raises(cspm.InputError, match=r"clam: no such scenario, allowed: calm, "):
        cspm.load_scenario("clam")
