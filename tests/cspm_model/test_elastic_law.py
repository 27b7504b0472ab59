"""The inverse of the cable's law: exact, from a table, and MuJoCo's own without either."""

import numpy as np
import pytest

from cspm_model.elastic_law import elongation_at, law_at, tabulated_elongation
from cspm_model.kernels.cable import OFFSET_LENGTH
from cspm_model.parameters import nominal_parameters


@pytest.fixture(scope="module")
def parameters(thesis):
    return nominal_parameters(thesis)


@pytest.fixture(scope="module")
def series(parameters):
    """Tensions [N] and unstretched lengths [m], both (k, n)."""
    random = np.random.default_rng(8)
    shape = 300, len(parameters.cables)
    return random.uniform(0.5, 60.0, shape), random.uniform(0.8, 2.5, shape)


def elastic(parameters, lengths):
    return lengths + parameters.cables[:, OFFSET_LENGTH]


def test_the_law_at_its_inverse_gives_the_tension_back(parameters, series):
    tensions, lengths = series
    found = elongation_at(parameters, tensions, elastic(parameters, lengths))
    back = law_at(parameters, found, elastic(parameters, lengths))
    assert back[:, :, 0] == pytest.approx(tensions, rel=1e-9)
    assert (back[:, :, 1] > 0.0).all()


def test_the_tangent_stiffness_is_the_slope_of_the_tension(parameters, series):
    tensions, lengths = series
    at, length = (
        elongation_at(parameters, tensions, elastic(parameters, lengths)),
        elastic(parameters, lengths),
    )
    up, down = (law_at(parameters, at + d, length)[:, :, 0] for d in (1e-8, -1e-8))
    slope = law_at(parameters, at, length)[:, :, 1]
    assert (up - down) / 2e-8 == pytest.approx(slope, rel=1e-4)


def test_a_near_start_leads_to_the_same_place(parameters, series):
    tensions, lengths = series
    length = elastic(parameters, lengths)
    found = elongation_at(parameters, tensions, length)
    again = elongation_at(parameters, tensions, length, near=1.1 * found)
    assert again == pytest.approx(found, abs=1e-12)


def test_slack_cables_are_not_stretched(parameters, series):
    tensions, lengths = series
    tensions = np.where(np.arange(len(tensions))[:, None] % 2, tensions, -1.0)
    found = elongation_at(parameters, tensions, elastic(parameters, lengths))
    assert (found[::2] == 0.0).all()
    assert (found[1::2] > 0.0).all()


def test_the_table_agrees_with_the_exact_inverse(parameters, series):
    tensions, lengths = series
    found = tabulated_elongation(parameters, tensions, lengths)
    exact = elongation_at(parameters, tensions, elastic(parameters, lengths))
    assert np.abs(found - exact).max() < 3e-4 * exact.max()


def test_the_table_leaves_out_what_is_missing(parameters, series):
    tensions, lengths = (values.copy() for values in series)
    tensions[3, 0] = lengths[5, 1] = np.nan
    tensions[:, 2] = np.nan
    found = tabulated_elongation(parameters, tensions, lengths)
    missing = np.isnan(tensions) | np.isnan(lengths)
    assert (np.isnan(found) == missing).all()


def test_mujocos_inverse_agrees(thesis, parameters, series):
    law = pytest.importorskip("cspm_sim.mujoco.cable_law", reason="MuJoCo is not installed")
    tensions, lengths = series
    length = elastic(parameters, lengths)
    found = elongation_at(parameters, tensions, length)
    for i, cable in enumerate(thesis.cables):
        row = np.array(law.law_row(cable.stiffness))
        other = [
            law.elongation_at(*at, row) for at in zip(tensions[:, i], length[:, i], strict=True)
        ]
        assert found[:, i] == pytest.approx(other, rel=1e-6)
