"""Values of the test-bed and planted effects from a command line."""

from pathlib import Path

import pytest

from cspm.changed_machine import changed_machine, of_testbed
from cspm.commands.diagnose_command import believed_line
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed

ROOT = Path(__file__).resolve().parents[2]
THESIS = load_testbed(ROOT / "scenarios" / "testbeds" / "thesis.yaml")
FRICTION = "winch_coulomb_friction@sway_3,sway_4:torque=0.02"


def test_keys_of_the_testbed_are_distinguished_from_those_of_the_scenario():
    given = ["seed=2", "testbed.bar.mass=5", "testbed=other.yaml"]
    assert of_testbed(given) == (["seed=2", "testbed=other.yaml"], ["bar.mass=5"])


def test_values_and_effects_reach_the_machine():
    found = changed_machine(THESIS, ["cables.sway_3.drum_radius=0.026"], [FRICTION]).testbed
    radii = {cable.name: cable.drum_radius for cable in found.cables}
    assert radii["sway_3"] == 0.026
    assert radii["sway_4"] == 0.025
    (entry,) = found.effects[len(THESIS.testbed.effects) :]
    assert (entry.effect, entry.elements) == ("winch_coulomb_friction", ("sway_3", "sway_4"))
    assert entry.parameters == {"torque": 0.02}


def test_without_changes_the_file_is_the_same():
    assert changed_machine(THESIS) == THESIS


def test_several_effects_follow_in_their_order_and_the_faulty_one_is_named():
    bias = "tension_bias@surge_1:bias=0.1"
    both = changed_machine(THESIS, [], [FRICTION, bias])
    assert both == changed_machine(changed_machine(THESIS, [], [FRICTION]), [], [bias])
    with pytest.raises(InputError, match=r"^--effect tension_bias@sway_9:bias=0.1: "):
        changed_machine(THESIS, [], [FRICTION, "tension_bias@sway_9:bias=0.1", bias])


@pytest.mark.parametrize(
    ("overrides", "effects", "text"),
    [
        (["cables.sway_9.drum_radius=1"], [], "no sway_9, allowed: hoist_1"),
        (["bar.mass"], [], "--set testbed.bar.mass: allowed: testbed.key.path=value"),
        (["bar.mass=-1"], [], "bar.mass: -1, allowed: greater than 0"),
        ([], ["winch_coulomb_friction"], "allowed: EFFECT@ELEMENT,…:PARAMETER=VALUE,…"),
        ([], ["winch_coulomb_friction@sway_3:torque=x"], "'torque=x', allowed: EFFECT@ELEMENT"),
        ([], ["winch_coulomb_friction@sway_9:torque=1"], "no element 'sway_9', allowed: hoist_1"),
        ([], ["friction@sway_3:torque=1"], "friction: no such effect, allowed: bar_com"),
    ],
)
def test_each_fault_is_one_line(overrides, effects, text):
    with pytest.raises(InputError) as caught:
        changed_machine(THESIS, overrides, effects)
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_verdict_names_what_it_compares_with():
    plain = THESIS.testbed.model_copy(update={"effects": ()})
    worn = changed_machine(THESIS, (), [FRICTION]).testbed
    assert "these are believed, not looked for; --testbed FILE" in believed_line(worn, None)
    assert "winch_coulomb_friction" in believed_line(worn, None)
    assert believed_line(plain, None).endswith("the test-bed thesis, which the recording carries")
    assert believed_line(worn, Path("own.yaml")) == "compared with the test-bed thesis (own.yaml)"
    assert believed_line(worn, Path("thesis")) == "compared with the test-bed thesis"
