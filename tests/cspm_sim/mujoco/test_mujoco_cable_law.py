"""The MuJoCo plant's cable law against its definition, and against the plant's."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import EXPONENTIAL, LINEAR
from scipy.integrate import quad

from cspm_model.kernels.cable import elastic_tension, law_scale
from cspm_msgs_py.testbed import ExponentialStiffness, LinearStiffness
from cspm_sim.mujoco.cable_law import elongation_at, law_row, tension_at
from cspm_sim.parameters import plant_parameters

LAWS = [
    ExponentialStiffness(**EXPONENTIAL),
    ExponentialStiffness(**{**EXPONENTIAL, "c": 0.0, "d": -0.05}),
    ExponentialStiffness(**{**EXPONENTIAL, "c": 0.02, "d": 0.0, "b": 0.3}),
    ExponentialStiffness(**{**EXPONENTIAL, "youngs_modulus": 1e12}),
    LinearStiffness(**LINEAR),
]


def elongation_by_quadrature(law, tension, length):
    """∫ dt/k, from the definition."""
    cap = law.axial_rigidity / length
    if law.law == "linear":
        return tension / cap

    def compliance(t):
        t = max(t, law.floor_tension)
        return 1.0 / min(law.a / length**law.b * (np.exp(law.c * t) - np.exp(law.d * t)), cap)

    edges = np.geomspace(law.floor_tension, max(tension, law.floor_tension), 40)
    edges = [0.0, *edges[edges < tension], tension]
    return sum(quad(compliance, *e)[0] for e in pairwise(edges))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("length", [0.4, 2.5, 7.0])
def test_elongation_is_the_integral_of_the_compliance(law, length):
    for tension in (0.01, 0.05, 0.3, 2.0, 9.0, 40.0, 90.0):
        expected = elongation_by_quadrature(law, tension, length)
        found = elongation_at(tension, length, np.array(law_row(law)))
        assert found == pytest.approx(expected, rel=1e-6)  # quad meets the kink at the cap


@settings(deadline=None)  # the first call compiles
@given(st.sampled_from(LAWS), st.floats(min_value=1e-6, max_value=150.0), st.floats(0.2, 10.0))
def test_tension_inverts_elongation(law, tension, length):
    row = np.array(law_row(law))
    found = tension_at(elongation_at(tension, length, row), length, row)
    assert found == pytest.approx(tension, rel=1e-11)


def test_a_cable_that_is_not_stretched_carries_nothing():
    for law in LAWS:
        assert tension_at(0.0, 2.0, np.array(law_row(law))) == 0.0
        assert tension_at(-0.1, 2.0, np.array(law_row(law))) == 0.0


def test_it_is_the_law_of_the_plant(thesis):
    parameters = plant_parameters(thesis)
    for i in (0, 2, 4):
        row = np.array(law_row(thesis.cables[i].stiffness))
        for length in (1.0, 2.5, 5.0):
            scale = law_scale(length, parameters.cables, i)
            for elongation in np.geomspace(1e-5, 0.1, 40):
                expected, _ = elastic_tension(
                    elongation, length, scale, parameters.cables, parameters.tables, i
                )
                assert tension_at(elongation, length, row) == pytest.approx(expected, abs=1e-9)
