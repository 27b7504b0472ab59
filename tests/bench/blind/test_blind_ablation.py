"""The diagnosis without one safeguard: what is left out, and that nothing else is."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from measured_samples import measured_with
from run_samples import run_to

from bench.blind.scoring.ablation import (
    ABLATIONS,
    Ablation,
    diagnose_without,
    with_modelled_tensions,
)
from bench.blind.scoring.point_window import make_point
from bench.blind.white_regression import WhiteSums
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.regression.block_regression import BlockRegression
from cspm_ident.diagnosis.residuals.recorded_equations import equations_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.winch.weak_form import make_window, weigh
from cspm_sim.effects import Channel, catalogue


@pytest.fixture(scope="module")
def measurement(tmp_path_factory):
    """Three seconds of the worst sea, read by the test-bed's sensors."""
    folder = tmp_path_factory.mktemp("ablation") / "bag"
    run_to(folder, "worst_case_steep", "duration=3")
    return read_measurement(folder)


def now(name):
    """What the diagnosis has under a name of `Ablation.replaced`."""
    module, *inner = name.rsplit(".", 2) if ".Model." in name else name.rsplit(".", 1)
    found = importlib.import_module(f"cspm_ident.diagnosis.{module}")
    for each in inner:
        found = getattr(found, each)
    return found


def test_each_ablation_leaves_out_one_thing():
    for name, ablation in ABLATIONS.items():
        prepared = ablation.prepare is not Ablation().prepare
        fewer = ablation.effects is not Ablation().effects
        assert prepared + fewer + bool(ablation.replaced) == 1, name
    with Ablation().active():
        assert all(now(k) is not v for each in ABLATIONS.values() for k, v in each.replaced.items())


@pytest.mark.parametrize("name", [k for k, v in ABLATIONS.items() if v.replaced])
def test_what_is_left_out_is_so_only_while_the_ablation_is_active(name):
    replaced = ABLATIONS[name].replaced
    before = {each: now(each) for each in replaced}
    with ABLATIONS[name].active():
        assert {each: now(each) for each in replaced} == dict(replaced)
    assert {each: now(each) for each in replaced} == before
    assert all(before[each] is not new for each, new in replaced.items())


def test_a_part_that_the_diagnosis_does_not_have_is_no_ablation():
    wrong = Ablation(replaced={"selection.search.Scatter": WhiteSums})
    with pytest.raises(AttributeError, match="Scatter"), wrong.active():
        pass


def test_without_joint_refit_no_number_of_the_file_is_looked_for():
    known = list(catalogue().values())
    assert ABLATIONS["held-out"].effects() == known
    left = ABLATIONS["joint-refit"].effects()
    assert left == [effect for effect in known if effect.physics.alter is None]
    assert 0 < len(left) < len(known)


def test_without_the_block_null_rows_count_as_independent():
    equation = Equation(
        Place(Channel.SHAFT, "one"),
        0.01 * np.arange(600),
        np.random.default_rng(1).standard_normal((600, 1)),
        {Candidate(catalogue()["winch_viscous_friction"], "one"): np.ones((600, 1, 1))},
        np.zeros((600, 1)),
    )
    gram = gather([[equation]], 0.5)
    assert type(Search(gram).sums) is BlockRegression
    with ABLATIONS["block-null"].active():
        assert type(Search(gram).sums) is WhiteSums


def test_a_point_sees_one_sample_at_the_places_of_the_window():
    curve = 0.5 * 2.5 * (np.arange(60) * 0.01) ** 2
    window, point = make_window(7, 0.01), make_point(7, 0.01)
    places = weigh(point.weights, np.arange(60.0), 5)
    assert len(places) == len(weigh(window.weights, np.arange(60.0), 5))
    np.testing.assert_allclose(places, weigh(window.weights, np.arange(60.0), 5))
    np.testing.assert_array_equal(weigh(point.weights, curve, 5), curve[places.astype(int)])
    np.testing.assert_allclose(weigh(point.second, curve, 5), 2.5)


def test_equations_at_points_are_noisier_at_the_same_places(measurement):
    windowed = {e.place: e for e in equations_of(measurement, [])}
    with ABLATIONS["weak-form"].active():
        pointed = {e.place: e for e in equations_of(measurement, [])}
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
def test_without_held_out_data_what_is_found_is_reported_unjudged(tmp_path):
    measured = measured_with(RUBBING, tmp_path / "bag", "worst_case_steep", "duration=16")
    found = diagnose_without(measured, "held-out")
    (finding,) = found.reported
    assert (finding.effect, finding.elements) == (
        "winch_coulomb_friction",
        ("surge_2",),
    )
    assert found.rejected == ()
