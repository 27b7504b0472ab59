"""Less of an effect than the file says, down to nothing."""

import pytest
from measured_samples import measured_with

from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.reporting.finding_statement import statement_of
from cspm_ident.diagnosis.reporting.improved_file import improved_testbed
from cspm_ident.diagnosis.reporting.verdict import Verdict, verdict_of
from cspm_ident.diagnosis.residuals.file_effects import (
    is_less,
    joined_entries,
    may_be_less,
    with_file_accuracies,
    with_file_bounds,
)
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry, parse_testbed
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_run.library import named_testbed
from cspm_sim.effects import catalogue
from cspm_sim.effects.survey import ACCURACY

DRY = "winch_coulomb_friction"
MACHINE = named_testbed("thesis").testbed


def entry(torque, *elements):
    return EffectEntry(effect=DRY, elements=elements, parameters={"torque": torque})


def with_effects(*entries):
    return MACHINE.model_copy(update={"effects": entries})


def test_bounds_hold_for_the_file_and_the_increment():
    """With a twentieth more, which noise takes; without an entry nothing is less than nothing."""
    dry, gain = catalogue()[DRY], catalogue()["winch_torque_gain"]
    lowered, same = with_file_bounds([dry, gain], with_effects(entry(0.01), entry(0.02, "surge_1")))
    assert lowered.parameters[0].minimum == pytest.approx(-0.021)
    assert same is gain
    (untouched,) = with_file_bounds([dry], with_effects())
    assert untouched is dry


@pytest.mark.parametrize(
    ("effect", "less"),
    [
        (DRY, True),
        ("winch_viscous_friction", True),
        # A number of the file, a reading, one that may be negative, one with memory, of a body.
        ("cable_stiffness", False),
        ("tension_gain", False),
        ("winch_torque_offset", False),
        ("cable_hysteresis", False),
        ("bar_linear_damping", False),
    ],
)
def test_what_may_be_less_than_a_file_says(effect, less):
    assert may_be_less(catalogue()[effect]) is less


def test_what_is_less_is_taken_off_the_entry_of_its_element():
    names = [cable.name for cable in MACHINE.cables]
    first, *others = names
    found = joined_entries(with_effects(entry(0.02)), [entry(-0.005, first)])
    assert [(e.elements, e.numbers["torque"]) for e in found] == [
        (tuple(others), 0.02),
        ((first,), pytest.approx(0.015)),
    ]
    gone = joined_entries(with_effects(entry(0.02, first)), [entry(-0.0201, first)])
    assert [(e.elements, e.numbers["torque"]) for e in gone] == [((first,), 0.0)]


def test_more_of_it_and_what_the_file_lacks_are_entries_of_their_own():
    more = entry(0.005, "surge_1")
    assert joined_entries(with_effects(entry(0.02)), [more]) == (entry(0.02), more)
    less = entry(-0.005, "surge_1")
    assert joined_entries(with_effects(), [less]) == (less,)


def test_an_entry_below_nothing_is_less():
    assert is_less(DRY, {"torque": -1e-6})
    assert not is_less(DRY, {"torque": 0.0})
    assert not is_less("winch_torque_offset", {"torque": -0.5})


WORN = """
effects:
  - effect: winch_coulomb_friction
    elements: [surge]
    parameters: {torque: 0.011}
"""


@pytest.mark.slow
def test_a_machine_with_less_friction_than_its_file_says_has_another_number(tmp_path):
    measured = measured_with(WORN, tmp_path / "recorded", "one_winch", "duration=15")
    believed = parse_testbed(measured.testbed.text + WORN.replace("0.011", "0.015"), "believed")
    found = diagnose([measured.with_testbed(believed)])
    assert verdict_of(found) is Verdict.PARAMETER
    (finding,) = found.reported
    assert "less dry friction than the test-bed file says: torque off by -4" in statement_of(
        found, finding
    )
    (improved,) = improved_testbed(found, "improved").testbed.effects
    assert improved.numbers["torque"] == pytest.approx(0.011, abs=1e-4)


def surveyed(*places):
    """The thesis's machine, with a wrapped `exit` of its first cables."""
    content = MACHINE.model_dump(mode="json", exclude_none=True, by_alias=True)
    for cable, about in zip(content["cables"], places, strict=False):
        cable["exit"] = {"value": cable["exit"], "provenance": "measured", **about}
    return parse_testbed(dump_yaml(content), "surveyed")


@pytest.mark.parametrize(
    ("places", "accuracy"),
    [
        ([], ACCURACY),
        ([{}], ACCURACY),
        ([{"accuracy": 1e-4}], ACCURACY),
        ([{"accuracy": 1e-4}] * 8, 1e-4),
        ([{"accuracy": 1e-4}] * 7 + [{"accuracy": 5e-3}], 5e-3),
        ([{"accuracy": 0.0}] * 8, None),
    ],
)
def test_a_file_says_how_well_its_places_are_known(places, accuracy):
    """The largest counts, the usual one where a cable states none; exact places are not tested."""
    exits, dry = catalogue()["cable_exit_offset"], catalogue()[DRY]
    *found, last = with_file_accuracies([exits, dry], surveyed(*places))
    assert last is dry
    assert [p.usual for each in found for p in each.parameters] == [accuracy] * 3 * len(found)
    assert bool(found) is (accuracy is not None)
    for each in found:
        assert each.is_negligible({"x": 3.6 * accuracy, "y": 0.0, "z": -3.6 * accuracy})
        assert not each.is_negligible({"x": 0.0, "y": 0.0, "z": -3.8 * accuracy})


def test_a_number_without_a_usual_accuracy_needs_one_of_every_cable():
    content = MACHINE.model_dump(mode="json", exclude_none=True, by_alias=True)
    effect = catalogue()["winch_inertia"]
    usual = []
    for cable in content["cables"]:
        value = cable["rotor_inertia"]
        cable["rotor_inertia"] = {"value": value, "provenance": "measured", "accuracy": 1e-6}
        (found,) = with_file_accuracies([effect], parse_testbed(dump_yaml(content), "stated"))
        usual.append(found.linear[0].usual)
    assert usual == [None] * (len(usual) - 1) + [1e-6]


def test_an_accuracy_is_never_negative():
    with pytest.raises(InputError, match=r"cables\[0\].exit: accuracy"):
        surveyed({"accuracy": -1e-3})
