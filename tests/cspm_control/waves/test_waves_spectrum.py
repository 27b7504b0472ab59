from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from cspm_control.waves.spectrum import enhancement_gain, jonswap, significant_wave_height

REFERENCE = Path(__file__).resolve().parents[4] / "shared" / "data" / "jonswap_reference"


@pytest.mark.parametrize("gamma", [1.0, 3.3, 5.0])
@pytest.mark.parametrize(
    ("name", "normalisation"), [("mhkit", "fitted"), ("wavespectra", "height")]
)
def test_agrees_with_the_tables_of_others(gamma, name, normalisation):
    path = REFERENCE / f"{name}_jonswap_Hs2.5_Tp8.csv"
    if not path.exists():
        pytest.skip("the reference tables of other packages are not at hand")
    table = np.loadtxt(path, delimiter=",")
    column = {1.0: 1, 3.3: 2, 5.0: 3}[gamma]
    density = jonswap(table[:, 0], 2.5, 8.0, gamma, normalisation)
    assert np.abs(density - table[:, column]).max() < 0.003 * table[:, column].max()


@pytest.mark.parametrize("gamma", [1.0, 2.0, 3.3, 7.0, 20.0])
@pytest.mark.parametrize("period", [0.862, 2.3, 8.0])
def test_four_roots_of_m0_are_the_height(gamma, period):
    peak = 1.0 / period

    def density(f):
        return float(jonswap(np.array([f]), 0.375, period, gamma)[0])

    pieces = [peak * ratio for ratio in (0.2, 0.8, 1.0, 1.3, 3.0, 60.0)]
    m0 = sum(quad(density, a, b, epsrel=1e-8)[0] for a, b in pairwise(pieces))
    assert 4.0 * np.sqrt(m0) == pytest.approx(0.375, rel=1e-5)


def test_the_fitted_factor_differs_from_the_exact_one_by_less_than_a_percent():
    for gamma in (1.5, 2.0, 3.3, 5.0):
        fitted = 1.0 - 0.287 * np.log(gamma)
        assert enhancement_gain(gamma) == pytest.approx(fitted, rel=1e-2)
    assert enhancement_gain(3.3) != pytest.approx(1.0 - 0.287 * np.log(3.3), rel=1e-3)


def test_without_enhancement_it_is_pierson_moskowitz():
    f = np.linspace(0.05, 1.0, 200)
    fp = 1.0 / 8.0
    expected = 0.3125 * 2.5**2 * fp**4 / f**5 * np.exp(-1.25 * (fp / f) ** 4)
    assert jonswap(f, 2.5, 8.0, 1.0) == pytest.approx(expected, rel=1e-9)


def test_the_peak_is_enhanced_by_gamma_and_wider_above():
    fp = 0.4
    f = fp * np.array([0.93, 1.0, 1.07])
    bare = jonswap(f, 1.0, 1 / fp, 1.0, "fitted")
    peaked = jonswap(f, 1.0, 1 / fp, 3.3, "fitted") / (1.0 - 0.287 * np.log(3.3))
    below, at, above = np.log(peaked / bare) / np.log(3.3)
    assert at == pytest.approx(1.0)
    assert below == pytest.approx(np.exp(-0.5))
    assert above == pytest.approx(np.exp(-0.5 * (7 / 9) ** 2))


def test_density_has_its_maximum_at_the_peak_period():
    f = np.linspace(0.1, 1.0, 9001)
    assert f[np.argmax(jonswap(f, 1.0, 2.5))] == pytest.approx(0.4, abs=2e-4)


def test_height_of_a_table():
    f = np.array([1.0, 2.0, 4.0])
    assert significant_wave_height(f, np.array([0.0, 2.0, 0.0])) == pytest.approx(4 * np.sqrt(3.0))
