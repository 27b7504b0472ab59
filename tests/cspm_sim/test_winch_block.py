"""Winches alone under measured torques and tensions, on machines with and without the rest."""

from dataclasses import replace

import numpy as np
import pytest
from emps_samples import DATA, ESTIMATION, MAPPING, TESTBED
from emps_samples import recorded as emps_needed
from import_samples import imported
from run_samples import run_to

from cspm_ident.block_simulation import Input
from cspm_ident.comparison.compare import compare
from cspm_ident.comparison.floor import lasting_rms
from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed


@pytest.fixture(scope="module")
def single(tmp_path_factory):
    """One winch on a fixed cable: no bar, no motion capture."""
    place = tmp_path_factory.mktemp("winch") / "bag"
    run_to(place, "one_winch", "duration=6")
    return read_measurement(place)


def with_inertia(measurement, factor):
    machine = measurement.machine
    cables = tuple(
        cable.model_copy(update={"rotor_inertia": cable.rotor_inertia * factor})
        for cable in machine.cables
    )
    return measurement.with_machine(machine.model_copy(update={"cables": cables}))


def speed_of(comparison):
    return next(c for c in comparison.channels if c.name == "winches/speed/surge")


def test_the_winch_itself_is_at_its_floor_and_another_is_not(single):
    found = compare(single)
    assert {c.block for c in found.channels} == {"whole", "winch"}
    assert found.left_out == {}
    own = speed_of(found)
    assert own.rms < 1.5 * own.floor
    assert own.vaf > 99.5
    # Torque less pull is what the inertia takes: with twice as much it turns half as fast.
    wrong = speed_of(compare(with_inertia(single, 2.0)))
    assert wrong.rms > 3.0 * own.rms


def test_a_winch_whose_torque_has_the_wrong_sign_turns_the_other_way(single):
    torque = Samples(single.torque.times, -single.torque.values)
    wrong = speed_of(compare(replace(single, torque=torque)))
    assert wrong.rms > 100.0 * speed_of(compare(single)).rms


def test_without_load_cells_the_winch_block_is_left_out(single):
    bare = replace(single, tension=None)
    found = compare(bare, Input.TORQUE)
    assert {c.block for c in found.channels} == {"whole"}
    assert found.left_out == {"winch": "/cables/tension not recorded"}


def test_nothing_to_compare_is_one_line(single):
    bare = replace(single, tension=None, torque=None, speed=None)
    with pytest.raises(InputError, match=r"--drive winch gives nothing that was measured, allowed"):
        compare(bare)


@emps_needed
def test_a_machine_without_cable_needs_no_load_cell(tmp_path):
    path = tmp_path / ESTIMATION
    path.symlink_to(DATA / ESTIMATION)
    rows = imported(path, MAPPING.read_text(encoding="utf-8"), TESTBED)
    times, (angle, torque) = rows.stamps["/winches/state"] * 1e-9, rows.rows["/winches/state"].T
    measured = Measurement(
        path,
        "",
        load_testbed(TESTBED),
        angle=Samples(times, angle[:, None].copy()),
        torque=Samples(times, torque[:, None].copy()),
    )
    found = compare(measured)
    assert found.left_out == {"whole": "nothing that it simulates was measured"}
    (channel,) = found.channels
    assert (channel.block, channel.name) == ("winch", "winches/angle/carriage")
    assert channel.vaf > 99.9
    # What the published model leaves out, a constant force among it, is no noise.
    assert channel.rms > 10.0 * channel.floor
    alone = compare(measured, Input.TORQUE)
    assert [c.block for c in alone.channels] == ["whole"]


def test_a_scatter_that_dies_out_counts_less_in_a_long_recording():
    scatter = np.full(300, 0.1)
    scatter[:100] = 1.0
    assert lasting_rms(scatter, 300) == pytest.approx(np.sqrt((100 + 2.0) / 300))
    assert lasting_rms(scatter, 10_000) == pytest.approx(np.sqrt((100 + 99.0) / 10_000))
    assert lasting_rms(np.full(5, np.nan), 10) == 0.0
