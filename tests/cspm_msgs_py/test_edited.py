"""Changed test-bed files: text, hash and description of one machine, always."""

import dataclasses
from hashlib import sha256

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import THESIS

from cspm_msgs_py.edited import file_of, with_effects, with_value, without_effect
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import EffectEntry, TestbedFile, load_testbed, parse_testbed

FILE = load_testbed(THESIS)
FRICTION = EffectEntry(
    effect="winch_coulomb_friction", elements=("sway_3",), parameters={"torque": 0.03}
)


def lines_changed(old, new):
    """Return the lines of either text that the other has not."""
    return set(old.text.splitlines()) ^ set(new.text.splitlines())


def check(file):
    """Text, hash and description are of one machine."""
    assert file.sha256 == sha256(file.text.encode()).hexdigest()
    assert parse_testbed(file.text, "again").testbed == file.testbed


@pytest.mark.parametrize("name", ["testbed", "provenance"])
def test_what_follows_from_the_text_cannot_be_replaced(name):
    with pytest.raises(ValueError, match=f"field {name} is declared with init=False"):
        dataclasses.replace(FILE, **{name: getattr(FILE, name)})


def test_a_replaced_text_takes_description_and_hash_with_it():
    other = dataclasses.replace(FILE, text=FILE.text.replace("gravity: 9.81", "gravity: 1.62"))
    assert other.testbed.gravity == 1.62
    assert other.sha256 != FILE.sha256
    check(other)


@settings(max_examples=20)
@given(mass=st.floats(0.1, 100.0))
def test_a_changed_number_is_the_one_given_bit_for_bit(mass):
    text = "name: m\nbar: {mass: 1.0, inertia: {ixx: 1, iyy: 1, izz: 1}, dimensions: [1, 1, 1]}\n"
    cable = FILE.testbed.cables[0].model_dump_json(exclude_none=True)
    small = TestbedFile(f"{text}cables: [{cable}]\n")
    assert with_value(small, "bar.mass", np.float64(mass)).testbed.bar.mass == mass


def test_a_changed_number_leaves_comments_and_all_other_lines():
    changed = with_value(FILE, "bar.mass", 5.2)
    check(changed)
    assert changed.testbed.bar.mass == 5.2
    assert "bar.mass" in FILE.provenance
    assert "bar.mass" not in changed.provenance
    [old, new] = sorted(lines_changed(FILE, changed), key=len, reverse=True)
    assert (new, old.split(":")[0]) == ("  mass: 5.2", "  mass")


@pytest.mark.parametrize("key", ["cables[6].rotor_inertia", "cables.sway_3.rotor_inertia"])
def test_a_cable_is_found_by_place_and_by_name(key):
    changed = with_value(FILE, key, 2e-5)
    check(changed)
    inertias = [cable.rotor_inertia for cable in changed.testbed.cables]
    before = [cable.rotor_inertia for cable in FILE.testbed.cables]
    assert inertias == [*before[:6], 2e-5, *before[7:]]


@pytest.mark.parametrize(
    ("key", "others"),
    [
        ("sensors./bar/pose.delay", "sensors./winch_frame/pose.delay"),
        ("sensors./winch_frame/pose.delay", "sensors./bar/pose.delay"),
    ],
)
def test_what_an_anchor_shares_changes_at_one_place_alone(key, others):
    changed = with_value(FILE, key, 0.004)
    check(changed)
    topic, other = (name.split(".")[1] for name in (key, others))
    assert changed.testbed.sensors[topic].delay == 0.004
    assert changed.testbed.sensors[other] == FILE.testbed.sensors[other]


@pytest.mark.parametrize("name", ["hoist_1", "hoist_2", "sway_4"])
def test_a_law_that_cables_share_changes_for_one(name):
    changed = with_value(FILE, f"cables.{name}.stiffness.a", 5000.0)
    check(changed)
    for before, after in zip(FILE.testbed.cables, changed.testbed.cables, strict=True):
        assert (after.stiffness.a == 5000.0) == (after.name == name)
        assert (after == before) == (after.name != name)


def test_an_effect_is_added_and_taken_away():
    planted = with_effects(FILE, [FRICTION])
    check(planted)
    assert planted.testbed.effects == (*FILE.testbed.effects, FRICTION)
    assert without_effect(planted, FRICTION.effect).testbed == FILE.testbed
    bare = without_effect(FILE, "bar_linear_damping")
    assert bare.testbed.effects == ()
    assert with_effects(bare, [FRICTION]).testbed.effects == (FRICTION,)


def test_a_description_becomes_a_file(general, rig, point):
    for machine in (FILE.testbed, general, rig, point):
        assert file_of(machine).testbed == machine


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("bar.mas", 5.2, "bar.mas: unknown key, allowed: mass, inertia, com, dimensions"),
        ("bar.mass", -1.0, "bar.mass: -1.0, allowed: greater than 0"),
        ("bar.mass", "heavy", "bar.mass: 'heavy', allowed: a number"),
        ("cables.sway_9.drum_radius", 0.02, "cables.sway_9.drum_radius: no sway_9, allowed: hoist"),
        ("cables[8].drum_radius", 0.02, r"cables\[8\].drum_radius: \[8\], allowed: 0 to 7"),
        ("bar.mass.x", 1.0, "bar.mass.x: x is inside no mapping, allowed: keys inside one"),
        ("", 1.0, ": allowed: a key path, such as bar.mass"),
        ("bar..mass", 1.0, "bar..mass: allowed: a key path"),
    ],
)
def test_a_change_that_is_none_is_refused_in_one_line(key, value, line):
    with pytest.raises(InputError, match=line):
        with_value(FILE, key, value)


def test_an_effect_that_is_not_there_cannot_be_taken_away():
    with pytest.raises(InputError, match="no effect cable_sag, it has: bar_linear_damping"):
        without_effect(FILE, "cable_sag")
