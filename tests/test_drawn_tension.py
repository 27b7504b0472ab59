"""Without load cells the winches tell the tensions, and their faults look like those of cells."""

from dataclasses import replace

import numpy as np
import pytest
from residual_samples import without_start, worst_sea

from cspm_ident.diagnosis.columns import Candidate, Place
from cspm_ident.diagnosis.drawn_tension import with_drawn_tension
from cspm_ident.diagnosis.recorded import equations_of
from cspm_ident.diagnosis.supposed import with_found
from cspm_ident.signals.samples import Samples
from cspm_sim.effect_entries import read_actions
from cspm_sim.effects import Channel, catalogue

BAR = Place(Channel.WRENCH, "bar")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Six seconds of the worst sea, read by ideal sensors."""
    return worst_sea(tmp_path_factory.mktemp("drawn") / "bag")


@pytest.fixture(scope="module")
def blind(whole):
    """The same without load cells."""
    return replace(whole, tension=None)


def by_place(measurement, *names):
    found = equations_of(measurement, [catalogue()[name] for name in names])
    return {equation.place: equation for equation in found}


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def test_torques_tell_the_tensions(whole, blind):
    drawn = with_drawn_tension(blind, ()).tension
    inner = slice(500, -500)
    measured = whole.tension
    columns = [np.interp(drawn.times[inner], measured.times, c) for c in measured.values.T]
    expected = np.stack(columns, axis=1)
    assert rms(drawn.values[inner] - expected) < 0.01 * rms(expected - expected.mean(axis=0))


def test_friction_of_the_file_is_allowed_for(whole, blind):
    """The same torques with friction in the file leave less for the cables, on its winch alone."""
    candidate = Candidate(catalogue()["winch_coulomb_friction"], "sway_1")
    rubbing = with_found(blind, {candidate: np.array([0.01])})
    plain = with_drawn_tension(blind, ()).tension
    drawn = with_drawn_tension(rubbing, read_actions(rubbing.machine)).tension
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
    assert with_drawn_tension(replace(blind, torque=None), ()) is None
    assert with_drawn_tension(replace(blind, angle=None), ()) is None
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


def test_what_torques_that_are_late_do_to_the_bar_is_never_told(blind, whole):
    """Torques a period late; with load cells there is no such thing."""
    values = blind.torque.values
    torque = Samples(blind.torque.times, np.vstack([values[:1], values[:-1]]))
    here, late = (by_place(m)[BAR] for m in (blind, replace(blind, torque=torque)))
    change = (late.target - here.target).reshape(-1)
    column = here.nuisance.reshape(change.size)
    left = change - column * (column @ change) / (column @ column)
    assert rms(change) > 0.0
    assert rms(left) < 0.1 * rms(change)
    assert not by_place(whole)[BAR].nuisance.size
