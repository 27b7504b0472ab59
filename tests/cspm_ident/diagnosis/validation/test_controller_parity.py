"""Recorded commands beside those that the described controllers make of the same measurements."""

from functools import partial

import pytest
from rewritten_recordings import rewrite
from run_samples import bundle_of

from cspm_ident.diagnosis.reporting.page_checks import controllers_table
from cspm_ident.diagnosis.validation import controller_parity as module
from cspm_ident.diagnosis.validation.controller_parity import LONGEST_S, controller_parity
from cspm_msgs_py.schedule import TENSION_COMMAND, TORQUE_COMMAND
from cspm_run.recorded_bundle import recorded_bundle
from cspm_run.recorded_run import run

STEPS = 400


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Controllers at several rates, in a sea, with the sensors' noise and delays."""
    folder = tmp_path_factory.mktemp("parity") / "bag"
    run(bundle_of("worst_case_steep", "rates.motion_controller=200"), folder, steps=STEPS)
    return folder


def different(found):
    return {each.node: each.different for each in found if each.different}


def test_the_described_controllers_make_the_recorded_commands_bit_for_bit(recorded):
    found = controller_parity(recorded)
    compared = {each.topic: each.compared for each in found}
    assert compared[TORQUE_COMMAND] == compared["/bar/reference"] == STEPS
    assert compared["/wrench_command"] == STEPS / 5
    assert {(each.different, each.largest) for each in found} == {(0, 0.0)}


def test_other_gains_show_in_that_controller_alone(recorded, monkeypatch):
    """What follows is fed with what was recorded, not with what the other gains make."""
    for path, node in (
        ("control.force.gains.sway_2.kp=0.01", "force_controller"),
        ("control.motion.gains.surge.kp=100.0", "motion_controller"),
    ):
        changed = partial(recorded_bundle, overrides=[path])
        monkeypatch.setattr(module, "recorded_bundle", changed)
        found = controller_parity(recorded)
        assert set(different(found)) == {node}
        assert max(each.largest for each in found) > 0.0


def test_one_command_that_was_changed_is_found(recorded, tmp_path):
    def change(name, i, row):
        if name == TORQUE_COMMAND and i == 100:
            row[3] += 1e-3
        return None if name == TENSION_COMMAND and i == STEPS - 1 else row

    (found,) = (
        each
        for each in controller_parity(rewrite(recorded, tmp_path / "changed", change))
        if each.topic == TORQUE_COMMAND
    )
    assert (found.compared, found.different) == (STEPS - 1, 1)
    assert found.largest == pytest.approx(1e-3)


def test_where_nothing_can_be_stepped_nothing_is_said(recorded, tmp_path):
    assert controller_parity(tmp_path) == ()
    run(bundle_of("verification_mid"), tmp_path / "locked", steps=50)
    assert controller_parity(tmp_path / "locked") == ()

    def drop(name, i, row):
        return None if i == 0 else row

    assert controller_parity(rewrite(recorded, tmp_path / "cut", drop)) == ()


def test_only_the_first_seconds_are_stepped(recorded, monkeypatch):
    monkeypatch.setattr(module, "LONGEST_S", 0.1)
    found = controller_parity(recorded)
    assert {each.compared for each in found if each.topic == TORQUE_COMMAND} == {100}
    assert LONGEST_S > 1.0


def test_the_page_has_the_controllers_where_there_are_any(recorded):
    data = {"controllers": [each._asdict() for each in controller_parity(recorded)]}
    table = controllers_table(data)
    for reported in ("force_controller", TORQUE_COMMAND, str(STEPS)):
        assert f">{reported}<" in table
    assert controllers_table({"controllers": []}) == controllers_table({}) == ""
