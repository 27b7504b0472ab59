"""The diagnosis without one safeguard: what is left out, and that nothing else is."""

from dataclasses import fields, replace

import numpy as np
import pytest
from measured_samples import measured_with
from run_samples import run_to

from bench.blind.scoring.ablation import ABLATIONS, diagnose_without, with_modelled_tensions
from cspm_ident.diagnosis.regression.block_regression import Sums
from cspm_ident.diagnosis.regression.white_regression import WhiteSums
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.selection.safeguards import ALL_SAFEGUARDS, Safeguards
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.winch.weak_form import make_point, make_window, maker, weigh
from cspm_sim.effects import catalogue


@pytest.fixture(scope="module")
def measurement(tmp_path_factory):
    """Three seconds of the worst sea, read by the test-bed's sensors."""
    folder = tmp_path_factory.mktemp("ablation") / "bag"
    run_to(folder, "worst_case", "duration=3")
    return read_measurement(folder)


def test_each_ablation_leaves_out_one_thing():
    switches = [field.name for field in fields(Safeguards)]
    for name, ablation in ABLATIONS.items():
        off = [switch for switch in switches if not getattr(ablation.safeguards, switch)]
        prepared = ablation.prepare is not type(ablation)().prepare
        assert len(off) + prepared == 1, name
        assert off in ([], [name.replace("-", "_")]), name
    assert all(getattr(ALL_SAFEGUARDS, switch) for switch in switches)


def test_without_joint_refit_no_number_of_the_file_is_looked_for():
    known = list(catalogue().values())
    assert ALL_SAFEGUARDS.effects == known
    left = Safeguards(joint_refit=False).effects
    assert left == [effect for effect in known if effect.physics.alter is None]
    assert 0 < len(left) < len(known)


def test_without_the_block_null_rows_count_as_independent():
    assert ALL_SAFEGUARDS.sums is Sums
    assert Safeguards(block_null=False).sums is WhiteSums


def test_a_point_sees_one_sample_at_the_places_of_the_window():
    curve = 0.5 * 2.5 * (np.arange(60) * 0.01) ** 2
    window, point = make_window(7, 0.01), make_point(7, 0.01)
    places = weigh(point.weights, np.arange(60.0), 5)
    assert len(places) == len(weigh(window.weights, np.arange(60.0), 5))
    np.testing.assert_allclose(places, weigh(window.weights, np.arange(60.0), 5))
    np.testing.assert_array_equal(weigh(point.weights, curve, 5), curve[places.astype(int)])
    np.testing.assert_allclose(weigh(point.second, curve, 5), 2.5)
    assert (maker(True), maker(False)) == (make_point, make_window)


def test_equations_at_points_are_noisier_at_the_same_places(measurement):
    windowed, pointed = (
        {e.place: e for e in equations_of(m, [])}
        for m in (measurement, replace(measurement, pointwise=True))
    )
    assert windowed.keys() == pointed.keys()
    louder = [np.median(pointed[p].noise / windowed[p].noise) for p in windowed]
    assert np.median(louder) > 1.5
    for place, equation in windowed.items():
        assert len(pointed[place].times) >= len(equation.times)


@pytest.mark.compiled
def test_modelled_tensions_know_nothing_of_the_load_cells_noise(measurement):
    tension = measurement.tension
    generator = np.random.default_rng(3)
    noisy = tension.values + generator.normal(0.0, 2.0, tension.values.shape)
    found = with_modelled_tensions(
        measurement.with_samples("tension", Samples(tension.times, noisy))
    ).tension
    inside = np.isin(tension.times, found.times)
    assert inside.mean() > 0.9
    error = found.values - tension.values[inside]
    assert np.sqrt(np.mean(error**2)) < 0.5
    assert np.any(error != 0.0)


def test_without_load_cells_there_is_nothing_to_replace(measurement):
    without = replace(measurement, tension=None)
    assert with_modelled_tensions(without) is without


RUBBING = """  - effect: winch_coulomb_friction
    elements: [surge_2]
    parameters: {torque: 0.05}
"""


@pytest.mark.slow
def test_without_held_out_data_what_is_found_is_told_unjudged(tmp_path):
    measured = measured_with(RUBBING, tmp_path / "bag", "worst_case", "duration=16")
    found = diagnose_without(measured, "held-out")
    (finding,) = found.reported
    assert (finding.effect, finding.elements) == (
        "winch_coulomb_friction",
        ("surge_2",),
    )
    assert found.rejected == ()
