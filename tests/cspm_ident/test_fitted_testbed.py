import difflib

import numpy as np
import pytest
from machines import THESIS

from cspm_ident.fitted_testbed import FittedNumber, with_fitted
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed

SHA, OTHER = "ab" * 32, "cd" * 32
TEXT = THESIS.read_text(encoding="utf-8")
NUMBER = FittedNumber(12000.123456, (11990.0, np.inf), (SHA,), ((1.0, 93.0),), "ramps")


def stiffness(cables, number=NUMBER):
    return {name: {"stiffness": {"a": number}} for name in cables}


def scales(file):
    return [cable.stiffness.a for cable in file.testbed.cables]


def changed_lines(text):
    found = difflib.ndiff(TEXT.splitlines(), text.splitlines())
    return [line for line in found if line[0] in "+-"]


def test_nothing_to_change_leaves_the_text():
    assert with_fitted(TEXT, "t.yaml", {}).text == TEXT


def test_a_law_goes_where_the_anchor_is():
    """Both hoists take it from one place, and the rest of the file stays letter for letter."""
    file = with_fitted(TEXT, "t.yaml", stiffness(["hoist_1", "hoist_2"]))
    assert scales(file)[:2] == [12000.123, 12000.123]
    assert scales(file)[2:] == scales(load_testbed(THESIS))[2:]
    lines = changed_lines(file.text)
    assert len(lines) == 2
    assert "11800.0" in lines[0]
    assert "12000.123" in lines[1]


@pytest.mark.parametrize("chosen", [["surge_1"], ["surge_2"], ["sway_3", "sway_1"]])
def test_cables_that_share_a_law_part_where_only_some_change(chosen):
    before = load_testbed(THESIS).testbed
    file = with_fitted(TEXT, "t.yaml", stiffness(chosen))
    for old, new in zip(before.cables, file.testbed.cables, strict=True):
        assert new.stiffness.a == (12000.123 if new.name in chosen else old.stiffness.a)
        assert new.damping == old.damping
        assert new.exit == old.exit


def test_the_number_says_where_it_comes_from():
    file = with_fitted(TEXT, "t.yaml", stiffness(["hoist_1"]))
    about = file.provenance["cables[0].stiffness.a"]
    assert about.provenance == "fitted"
    assert about.recording == SHA
    assert about.window == (1.0, 93.0)
    assert about.interval == (11990.0, None)
    assert about.note == "ramps"
    assert about.further_recordings == ()
    assert load_testbed(THESIS).provenance["cables[0].stiffness.b"].provenance == "reconstructed"
    several = FittedNumber(1.0, (0.5, 2.0), (SHA, OTHER), ((1.0, 93.0), (0.5, 40.0)))
    about = with_fitted(TEXT, "t.yaml", stiffness(["hoist_1"], several)).provenance[
        "cables[0].stiffness.a"
    ]
    assert about.further_recordings == (OTHER,)
    assert about.window == (1.0, 93.0)
    assert about.further_windows == ((0.5, 40.0),)


def test_plain_numbers_go_in_as_they_are():
    changes = {"hoist_1": {"damping": {"constant": NUMBER, "factor": 1.0}}}
    cable = with_fitted(TEXT, "t.yaml", changes).testbed.cables[0]
    assert (cable.damping.constant, cable.damping.factor) == (12000.123, 1.0)
    assert cable.damping.slope == 3.44


def test_faults_are_one_line():
    with pytest.raises(InputError) as caught:
        with_fitted(TEXT, "t.yaml", stiffness(["hoist_9"]))
    assert str(caught.value).startswith("t.yaml: no cable hoist_9, allowed: hoist_1, hoist_2, ")
    with pytest.raises(InputError) as caught:
        with_fitted(TEXT, "t.yaml", stiffness(["hoist_1"], FittedNumber(-1.0, (0, 1), (SHA,))))
    assert str(caught.value) == "t.yaml: cables[0].stiffness.a: -1.0, allowed: greater than 0"
