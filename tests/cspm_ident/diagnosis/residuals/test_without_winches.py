"""Poses and load cells without winches, and winches that are locked."""

from dataclasses import replace

import numpy as np
import pytest
from residual_samples import worst_sea
from rewritten_recordings import rewrite
from run_samples import SCENARIOS, bundle_of, run_to

from cspm_ident.data_look.motion_checks import excitation_check
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed, parse_testbed
from cspm_run.assembly import resolve
from cspm_sim.effects import Channel, catalogue

BAR = Place(Channel.WRENCH, "bar")
THESIS = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml")


def locked(*names):
    """The thesis's machine with some winches, or all, held by their brakes."""
    lines = THESIS.text.splitlines()
    every = names or THESIS.testbed.cable_names
    found = []
    for line in lines:
        found.append(line)
        if line.strip().removeprefix("- ").removeprefix("name: ") in every:
            found.append("    locked: true")
    return parse_testbed("\n".join(found), "locked.yaml")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return worst_sea(tmp_path_factory.mktemp("whole") / "bag")


def by_place(measurement, *names):
    found = equations_of(measurement, [catalogue()[name] for name in names])
    return {equation.place: equation for equation in found}


def test_the_bars_equation_is_the_same_without_winches(whole):
    without = replace(whole, angle=None, speed=None, torque=None, command=None)
    found, before = by_place(without, "bar_mass"), by_place(whole, "bar_mass")
    assert set(found) == {BAR}
    mass = Candidate(catalogue()["bar_mass"], "bar")
    np.testing.assert_allclose(found[BAR].target, before[BAR].target, atol=1e-9)
    np.testing.assert_allclose(found[BAR].columns[mass], before[BAR].columns[mass], atol=1e-9)


def test_without_tensions_as_well_nothing_is_left(whole):
    assert by_place(replace(whole, angle=None, speed=None, torque=None, tension=None)) == {}


@pytest.fixture(scope="module")
def held(tmp_path_factory):
    """Eight seconds with locked winches, and the same without anything of the winches."""
    place = tmp_path_factory.mktemp("held")
    run_to(place / "bag", "verification_mid", "duration=8")
    bare = rewrite(
        place / "bag", place / "bare", lambda topic, _, row: row if "winches" not in topic else None
    )
    return place / "bag", bare


def test_locked_winches_need_no_encoder(held):
    bag, bare = held
    assert read_measurement(bare, THESIS).angle is None
    found = read_measurement(bare, locked())
    assert np.ptp(found.angle.values) == 0.0
    assert excitation_check(found).ok
    assert not excitation_check(read_measurement(bag, THESIS)).ok
    with_cables, measured = by_place(found), by_place(read_measurement(bag, THESIS))
    cables = {Place(Channel.TENSION, name) for name in THESIS.testbed.cable_names}
    assert set(with_cables) == cables | {BAR}
    for place in cables:
        here, there = (np.std(each[place].target) for each in (with_cables, measured))
        assert here < 1.2 * there


def test_a_locked_winchs_encoder_reads_a_constant(whole, held):
    bag, _ = held
    found = read_measurement(bag, locked("surge_2"))
    index = THESIS.testbed.cable_names.index("surge_2")
    assert np.ptp(found.angle.values[:, index]) == 0.0
    before = read_measurement(bag, THESIS).angle.values
    others = [i for i in range(8) if i != index]
    np.testing.assert_array_equal(found.angle.values[:, others], before[:, others])


def test_a_run_may_lock_all_winches_and_no_single_one():
    bundle = bundle_of("verification_mid")
    assert resolve(bundle.scenario, locked().testbed) == bundle.scenario
    for scenario, machine in (
        (bundle.scenario, locked("surge_2")),
        (bundle_of("calm").scenario, locked()),
    ):
        with pytest.raises(InputError, match=r"^locked: .*surge_2.*, allowed in a run: all winche"):
            resolve(scenario, machine.testbed)
