"""What an improved test-bed file says, in the words and order of one's own."""

from pathlib import Path

import pytest

from cspm_ident.fitted_testbed import FittedNumber, with_fitted
from cspm_ident.merged_testbed import differences, merged_testbed
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import parse_testbed

FILE = Path(__file__).parents[2] / "scenarios" / "testbeds" / "thesis.yaml"
THESIS = FILE.read_text(encoding="utf-8").partition("\neffects:")[0] + "\n"
EFFECTS = """\
# What we know of wear.
effects:
  # measured by hand in May
  - effect: winch_coulomb_friction
    elements: [sway_1]
    parameters: {torque: 0.01}
  - effect: bar_mass
    parameters: {mass: 0.1}  # the new clamp
"""
OWN = parse_testbed(THESIS + EFFECTS, "own.yaml")
FITTED = FittedNumber(0.02, (0.019, 0.021), ("0" * 64,))


def changed_lines(text, other):
    return [line for line in other.splitlines() if line not in text.splitlines()]


def test_one_number_changes_one_line_and_nothing_else():
    without_comments = with_fitted(THESIS, "x", {"surge_2": {"drum_radius": FITTED}})
    bare = "\n".join(x for x in without_comments.text.splitlines() if not x.startswith("#"))
    improved = parse_testbed(bare + "\n" + EFFECTS, "improved.yaml")
    merged = merged_testbed(OWN, improved)
    assert merged.testbed == improved.testbed
    assert merged.source == "own.yaml"
    (line,) = changed_lines(OWN.text, merged.text)
    assert line.startswith("    drum_radius: {value: 0.02, provenance: fitted, recording: ")
    for comment in ("# The thesis's test-bed.", "# measured by hand in May", "# the new clamp"):
        assert comment in merged.text
    (found,) = differences(OWN, merged)
    assert found.words == "cables[surge_2].drum_radius: 0.025 (thesis) → 0.02 (fitted)"


def test_a_number_of_a_cable_that_lends_its_numbers_changes_there_alone():
    improved = with_fitted(OWN.text, "x", {"hoist_1": {"stiffness": {"a": FITTED}}})
    merged = merged_testbed(OWN, improved)
    assert merged.testbed == improved.testbed
    assert merged.testbed.cables[0].stiffness.a == 0.02
    assert merged.testbed.cables[1].stiffness.a == 11800.0


def test_effects_are_known_by_their_elements_and_new_ones_follow():
    text = OWN.text.replace("torque: 0.01", "torque: 0.03").replace(
        "  - effect: bar_mass\n    parameters: {mass: 0.1}  # the new clamp\n",
        "  - effect: cable_sag\n    elements: [sway_2]\n    parameters: {linear_density: 0.001}\n",
    )
    improved = parse_testbed(text, "improved.yaml")
    merged = merged_testbed(OWN, improved)
    assert merged.testbed == improved.testbed
    assert "# measured by hand in May" in merged.text
    assert [each.words for each in differences(OWN, merged)] == [
        "effects[winch_coulomb_friction@sway_1].parameters.torque: 0.01 → 0.03",
        "effects[bar_mass]: bar_mass on all: mass 0.1 → nothing",
        "effects[new]: nothing → cable_sag on sway_2: linear_density 0.001",
    ]


def test_equal_files_stay_as_they_are():
    again = parse_testbed(OWN.text, "again.yaml")
    assert differences(OWN, again) == []
    assert merged_testbed(OWN, again).text == OWN.text


def test_a_file_of_another_machine_is_refused():
    other = parse_testbed(OWN.text.replace("name: sway_4", "name: aft"), "other.yaml")
    with pytest.raises(InputError, match=r"^other\.yaml: cables aft, .*, allowed: those of own"):
        merged_testbed(OWN, other)
