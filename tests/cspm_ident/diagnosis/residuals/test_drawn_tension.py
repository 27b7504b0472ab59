"""Without load cells the winches show the tensions, and their faults look like those of cells."""

from dataclasses import replace

import numpy as np
import pytest
from residual_samples import without_start, worst_sea
from run_samples import SCENARIOS, bundle_of

from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.residuals.corrected_measurement import with_found
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.virtual_load_cell import drawn_tension
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.smoothing import filtered
from cspm_msgs_py.testbed import EffectEntry
from cspm_run.recorded_run import run
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Channel, catalogue

BAR = Place(Channel.WRENCH, "bar")
COULOMB = catalogue()["winch_coulomb_friction"]
RUBBED = 0.031


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Six seconds of the worst sea, read by ideal sensors."""
    return worst_sea(tmp_path_factory.mktemp("drawn") / "bag")


@pytest.fixture(scope="module")
def blind(whole):
    """The same without load cells."""
    return replace(whole, tension=None)


def by_place(measurement, *names, **options):
    found = equations_of(measurement, [catalogue()[name] for name in names], **options)
    return {equation.place: equation for equation in found}


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory):
    """Six seconds of it with dry friction at a winch of which the file does not know."""
    described = bundle_of("worst_case_steep", "duration=6", "sensors=ideal")
    machine = described.testbed.testbed
    entry = EffectEntry(effect=COULOMB.id, elements=("surge_2",), parameters={"torque": RUBBED})
    machine = machine.model_copy(update={"effects": (*machine.effects, entry)})
    folder = tmp_path_factory.mktemp("rubbing") / "bag"
    run(described.concealing(machine), folder)
    return read_measurement(folder, SCENARIOS / "testbeds" / "thesis.yaml")


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def weight_of(values, *columns):
    """Return least-squares weights of columns in values, all of any shape."""
    table = np.stack([column.reshape(-1) for column in columns], axis=1)
    return np.linalg.lstsq(table, values.reshape(-1), rcond=None)[0]


def test_torques_show_the_tensions(whole, blind):
    drawn = drawn_tension(blind, ()).measurement.tension
    inner = slice(500, -500)
    measured = whole.tension
    columns = [np.interp(drawn.times[inner], measured.times, c) for c in measured.values.T]
    expected = np.stack(columns, axis=1)
    assert rms(drawn.values[inner] - expected) < 0.01 * rms(expected - expected.mean(axis=0))


def test_drawn_tensions_are_not_late(whole, blind):
    """A torque holds for a step, speeds are of its ends: half of a step is 4 % of a damper."""
    drawn = drawn_tension(blind, ()).measurement.tension
    inner = slice(500, -500)
    measured, step = whole.tension, whole.tension.interval
    for drew, column in zip(drawn.values.T, measured.values.T, strict=True):
        times, rate = measured.times, np.gradient(column, step)
        expected, rates = (np.interp(drawn.times[inner], times, c) for c in (column, rate))
        (late,) = weight_of(expected - drew[inner], rates)
        assert abs(late) < 0.1 * step


def test_a_column_is_what_friction_adds_also_where_a_shaft_chatters(blind):
    """To rounding: smoothed from every sample as the tension is, not evaluated of a slow speed."""
    candidate = Candidate(COULOMB, "sway_1")
    rubbed = with_found(blind, {candidate: np.array([RUBBED])})
    plain = drawn_tension(blind, ())
    drawn = drawn_tension(rubbed, read_actions(rubbed.machine))
    times = plain.times[500:-500:5]
    i = blind.machine.cable_names.index("sway_1")
    ((named, column),) = plain.columns(COULOMB, i, times)
    assert named == candidate
    change = [filtered(d.measurement.tension, d.band)[0][500:-500:5, i] for d in (plain, drawn)]
    np.testing.assert_allclose(RUBBED * column[:, 0], change[0] - change[1], atol=1e-9)
    assert not any(plain.columns(catalogue()["cable_stiffness"], i, times))


def test_laws_are_taken_about_tensions_without_the_friction_supposed(rubbing):
    """A law about what friction looks like takes a part of it for elongation."""
    blind = replace(rubbing, tension=None)
    candidate, found = Candidate(COULOMB, "surge_2"), []
    for assumed in ({}, {candidate: np.array([RUBBED])}):
        own = by_place(blind, COULOMB.id, assumed=assumed)[Place(Channel.TENSION, "surge_2")]
        columns = own.columns[candidate][:, :, 0], *own.nuisance.transpose(2, 0, 1)
        found.append(weight_of(own.target, *columns)[0])
    assert found[0] < 0.97 * RUBBED
    assert found[1] == pytest.approx(RUBBED, rel=0.015)


def test_what_a_shaft_holds_while_it_reverses_is_never_reported(rubbing):
    """Apart from it friction is what was planted; with it too little, for a shaft that sticks."""
    blind = replace(rubbing, tension=None)
    candidate = Candidate(COULOMB, "surge_2")
    found = by_place(blind, COULOMB.id, assumed={candidate: np.array([RUBBED])})
    for place in (BAR, Place(Channel.TENSION, "surge_2")):
        own = found[place]
        column, free = own.columns[candidate][:, :, 0], own.nuisance.transpose(2, 0, 1)
        alone = weight_of(own.target, column, free[0])[0]
        apart = weight_of(own.target, column, *free)[0]
        assert alone < 0.99 * RUBBED, place
        assert abs(apart - RUBBED) < 0.5 * abs(alone - RUBBED), place


def test_friction_of_the_file_is_allowed_for(whole, blind):
    """The same torques with friction in the file leave less for the cables, on its winch alone."""
    candidate = Candidate(catalogue()["winch_coulomb_friction"], "sway_1")
    rubbing = with_found(blind, {candidate: np.array([0.01])})
    plain = drawn_tension(blind, ()).measurement.tension
    drawn = drawn_tension(rubbing, read_actions(rubbing.machine)).measurement.tension
    i = whole.machine.cable_names.index("sway_1")
    cable = whole.machine.cables[i]
    change = drawn.values - plain.values
    speed = np.interp(drawn.times, whole.angle.times, np.gradient(whole.angle.values[:, i]))
    turning = np.abs(speed) > 0.2 * rms(speed)
    expected = -0.01 * np.sign(speed) * cable.gear_ratio / cable.drum_radius
    np.testing.assert_allclose(change[turning, i], expected[turning], rtol=1e-6)
    assert not np.delete(change, i, axis=1).any()


def test_residuals_are_those_of_cables_and_bar(blind):
    places = by_place(blind)
    names = blind.machine.cable_names
    expected = {Place(kind, n) for kind in (Channel.DRIVE, Channel.TENSION) for n in names}
    assert set(places) == expected | {BAR}
    for place, equation in places.items():
        if place.channel is not Channel.DRIVE:
            left = without_start(equation, equation.target)
            assert rms(left) < 0.02 * rms(equation.measured - equation.measured.mean(0)), place


def test_a_machine_that_cannot_be_measured_has_no_drawn_tension(blind):
    assert drawn_tension(replace(blind, torque=None), ()) is None
    assert drawn_tension(replace(blind, angle=None), ()) is None
    channels = {p.channel for p in by_place(replace(blind, torque=None))}
    assert not channels & {Channel.TENSION, Channel.WRENCH}


@pytest.mark.parametrize(
    ("name", "weight"),
    [("winch_coulomb_friction", 0.002), ("winch_viscous_friction", 2e-4)],
)
def test_a_winch_s_fault_shows_in_its_cable_and_in_the_bar(blind, name, weight):
    """What the file has too much of is missing with the opposite sign."""
    candidate = Candidate(catalogue()[name], "sway_1")
    here = by_place(blind, name)
    wrong = by_place(with_found(blind, {candidate: np.array([weight])}), name)
    own = Place(Channel.TENSION, "sway_1")
    for place, equation in here.items():
        assert (candidate in equation.columns) == (place in (own, BAR)), place
    for place in (own, BAR):
        equation = here[place]
        change = without_start(equation, wrong[place].target - equation.target)
        expected = without_start(equation, weight * equation.columns[candidate][:, :, 0])
        assert rms(change + expected) < 0.05 * rms(expected), place
        assert rms(change - expected) > rms(expected), place


def test_a_load_cell_that_is_not_there_has_no_faults(blind):
    for equation in by_place(blind, "tension_gain", "tension_bias").values():
        assert not equation.columns


def test_what_torques_that_are_late_do_to_the_bar_is_never_reported(blind, whole):
    """Torques a period late; with load cells there is no such thing."""
    values = blind.torque.values
    torque = Samples(blind.torque.times, np.vstack([values[:1], values[:-1]]))
    here, late = (by_place(m)[BAR] for m in (blind, replace(blind, torque=torque)))
    change = (late.target - here.target).reshape(-1)
    column = here.nuisance[:, :, 0].reshape(change.size)
    left = change - column * (column @ change) / (column @ column)
    assert rms(change) > 0.0
    assert rms(left) < 0.1 * rms(change)
    assert not by_place(whole)[BAR].nuisance.size


def test_what_is_not_reported_is_one_number_for_all_stretches(rubbing):
    """However often a reading was lost; lengths at the start are of each stretch."""
    blind = replace(rubbing, tension=None)
    torque = blind.torque
    kept = np.delete(np.arange(len(torque.times)), [3000])
    lost = Samples(torque.times[kept], torque.values[kept])
    counts = []
    for each in (blind, replace(blind, torque=lost)):
        found = gather([equations_of(each, [COULOMB])], 0.5)
        counts.append(len(found.nuisance))
    cables = len(blind.machine.cables)
    assert counts == [1 + 3 * cables, 1 + 4 * cables]
