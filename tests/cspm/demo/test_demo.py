"""The demonstration: what it conceals and offers, and that it runs from the command line."""

import json

import numpy as np
import pytest

import cspm as door
from cspm.commands import demo_command
from cspm.demo.concealment import CONCEALABLE, drawn
from cspm.demo.guess import CHOICES, choices, guessed
from cspm_msgs_py.errors import InputError
from cspm_sim.effects import catalogue


@pytest.fixture(scope="module")
def machine():
    return door.load_testbed("thesis")


def seeded(seed=3):
    return np.random.default_rng(seed)


@pytest.mark.parametrize("name", CONCEALABLE)
def test_what_is_concealed_is_there_and_allowed(machine, name):
    (found,) = drawn(machine, seeded(), 1, 1.0, name)
    assert found.effect == name
    for each in catalogue()[name].parameters:
        least, most = each.allowed
        assert least <= found.parameters[each.name] <= most
        assert found.parameters[each.name] != each.absent
    machine.with_effect(found.effect, found.element, **found.parameters)
    assert catalogue()[name].words in found.words


def test_the_same_seed_conceals_the_same_and_another_another(machine):
    assert drawn(machine, seeded(), 1, 1.0, None) == drawn(machine, seeded(), 1, 1.0, None)
    assert len({drawn(machine, seeded(k), 1, 1.0, None)[0].words for k in range(12)}) > 6


def test_two_are_different_effects_on_different_parts_and_smaller(machine):
    for seed in range(12):
        one, other = drawn(machine, seeded(seed), 2, 0.5, None)
        assert one.effect != other.effect
        assert one.element != other.element
    (whole,) = drawn(machine, seeded(), 1, 1.0, "winch_coulomb_friction")
    (half,) = drawn(machine, seeded(), 1, 0.5, "winch_coulomb_friction")
    assert half.parameters["torque"] == pytest.approx(0.5 * whole.parameters["torque"])


def test_what_cannot_be_concealed_is_one_line(machine):
    with pytest.raises(InputError, match=r"^--effect pose_delay: allowed: winch_coulomb_friction,"):
        drawn(machine, seeded(), 1, 1.0, "pose_delay")


def test_the_truth_is_among_the_choices_but_not_at_one_place(machine):
    places = set()
    for seed in range(12):
        (truth,) = drawn(machine, seeded(seed), 1, 1.0, None)
        offered = choices(machine, truth, seeded(seed))
        assert len({each.words for each in offered}) == CHOICES
        places.add(offered.index(truth))
    assert len(places) > 2


def test_a_guess_is_asked_until_it_is_a_number(machine):
    (truth,) = drawn(machine, seeded(), 1, 1.0, None)
    offered = choices(machine, truth, seeded())
    answers, lines = iter(["0", "six", " 2 "]), []
    assert guessed(offered, lambda _: next(answers), lines.append) is offered[1]
    assert lines[-2:] == ["0: no such number", "six: no such number"]
    assert guessed(offered, lambda _: "", lines.append) is None


@pytest.mark.slow
def test_the_command_names_friction_and_leaves_its_pages(cspm, tmp_path, monkeypatch):
    monkeypatch.setattr(demo_command, "DURATION_S", 8.0)
    words = ("demo", "--seed", "4", "--effect", "winch_coulomb_friction", "--out", "shown")
    code, out, err = cspm(*words, "--json", "demo.json")
    assert (code, err) == (0, "")
    found = json.loads((tmp_path / "demo.json").read_text())
    (truth,) = found["concealed"]
    assert found["named"] == [True]
    assert found["torque_rms_nm"]["after"] < found["torque_rms_nm"]["before"]
    place = truth["element"].replace("_", " ")
    assert f"dry friction of winch {place}, torque" in out
    assert "named by the diagnosis" in out
    for name in ("recorded/summary.json", "verdict/diagnosis.html", "improved/summary.json"):
        assert (tmp_path / "shown" / name).is_file()
    page = (tmp_path / "shown" / "see_it.html").read_text(encoding="utf-8")
    assert f'"element": "{truth["element"]}", "words": "winch {place}"' in page
    assert cspm(*words)[0] == 2
