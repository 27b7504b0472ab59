"""A machine with physics that the catalogue given lacks: described by a table, and simulated."""

from pathlib import Path

import numpy as np
import pytest
from measured_samples import measured_with

from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.reporting.improved_file import improved_testbed
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Channel, catalogue

UNNAMED = """
effects:
  - effect: winch_stribeck_friction
    elements: [surge]
    parameters: {breakaway_torque: 0.03, coulomb_torque: 0.02, stribeck_speed: 1.0}
"""
KNOWN = [catalogue()[name] for name in ("winch_torque_offset", "cable_stiffness")]

pytestmark = [pytest.mark.slow, pytest.mark.compiled]


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("unnamed") / "rig"
    return measured_with(UNNAMED, folder, "one_winch")


@pytest.fixture(scope="module")
def found(measured):
    return diagnose([measured], effects=KNOWN)


def test_what_no_effect_explains_is_a_table_of_its_driver(found):
    ((candidate, values),) = found.tables.items()
    table = candidate.effect.table
    assert (candidate.element, table.place, table.driver) == ("surge", "winch_torque", "speed")
    knots = np.array(table.knots)
    assert np.all(values * knots > 0.0)
    assert np.interp(1e-2, knots, values) > 0.015, "dry friction jumps where the speed reverses"
    at = np.array([-2.0, 2.0])
    expected = np.sign(at) * (0.02 + 0.01 * np.exp(-(at**2)))
    assert np.interp(at, knots, values) == pytest.approx(expected, rel=0.1)


def test_the_table_brings_held_out_residual_and_simulation_down(found):
    (shaft,) = (fit for fit in found.fit if fit.place.channel is Channel.SHAFT)
    assert shaft.after > 2.0 * shaft.noise
    assert shaft.final < 0.4 * shaft.after
    (angle,) = found.simulated
    assert angle.final < 0.2 * angle.after


def test_the_improved_file_has_the_table_and_reads_back(found):
    improved = improved_testbed(found, "improved.yaml")
    (action,) = read_actions(improved.testbed)
    assert (action.effect.id, action.name) == ("empirical", "surge")
    ((_, values),) = found.tables.items()
    assert list(action.values.values()) == pytest.approx(values, rel=1e-6)
    assert "describes the unmodelled residual and does not explain it" in improved.text
    place = "effects[0].parameters.values"
    assert improved.provenance[place].provenance == "fitted"


def test_the_report_tells_the_whole_file_from_the_named_effects(found):
    data = diagnosis_data(found, Path("rig.yaml"))
    (entry,) = data["empirical"]
    assert entry["statement"].startswith(
        "A table of values describes the torque of winch surge as a function of speed, over a range"
    )
    assert "it explains nothing. On held-out data the residual falls from" in entry["statement"]
    (row,) = (r["held_out"] for r in data["residuals"] if r["channel"] == "winches/torque/surge")
    assert row["nrmse_after"] < 0.5 * row["nrmse_named"]
    assert data["model"] == "testbed.improved.yaml"


def test_a_machine_that_is_as_described_gets_no_table(measured):
    known = [catalogue()["winch_stribeck_friction"], *KNOWN]
    named = diagnose([measured], effects=known)
    assert [each.effect for each in named.reported] == ["winch_stribeck_friction"]
    assert named.tables == {}
    data = diagnosis_data(named, Path("rig.yaml"))
    assert data["empirical"] == []
    assert all("nrmse_named" not in row["held_out"] for row in data["residuals"])
