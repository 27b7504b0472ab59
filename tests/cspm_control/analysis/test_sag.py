"""Cables with weight at rest: balance of the whole, and the plant with its effect of sag."""

import numpy as np
import pytest
from machines import build, entry, pulley_content

from cspm_control.analysis.sag import sagging_cables
from cspm_model.equilibrium import find_equilibrium
from cspm_model.kernels.cable import ATTACHMENT, EXIT
from cspm_model.kinematics import rotation
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.errors import ConvergenceError, InputError
from cspm_msgs_py.testbed import EffectEntry
from cspm_run.library import named_testbed
from cspm_sim.effect_entries import read_actions
from cspm_sim.rest import static_wrench

ORIGIN = np.zeros(6)
COGIRO = named_testbed("cogiro").testbed
POSE = (0.5, 0.3, -1.5, 0.0, 0.0, 0.0)


def test_exits_carry_the_weight_of_bar_and_cables_together():
    density = 0.05
    found = sagging_cables(COGIRO, POSE, np.full(8, density))
    parameters = nominal_parameters(COGIRO)
    cables = parameters.cables
    arms = cables[:, ATTACHMENT : ATTACHMENT + 3] @ rotation(POSE).T
    apart = POSE[:3] + arms - cables[:, EXIT : EXIT + 3]
    length = np.linalg.norm(apart, axis=1)
    weight = 9.81 * density * length
    # A parabola leaves half of its weight at either end and pulls along the line in its middle.
    for each, own in zip(found, weight, strict=True):
        assert each.tension > each.straight
        assert each.tension - each.end_tension < own
    middle = np.array([0.5 * (each.tension + each.end_tension) for each in found])
    up = middle * apart[:, 2] / length
    assert up.sum() == pytest.approx(COGIRO.bar.mass * 9.81 + 0.5 * weight.sum(), rel=1e-3)
    level = (middle[:, None] * apart[:, :2] / length[:, None]).sum(axis=0)
    assert np.abs(level).max() < 1e-3 * middle.max()


@pytest.mark.parametrize("density", [0.01, 0.05])
def test_the_plants_effect_of_sag_adds_the_same_tensions(density):
    entries = [EffectEntry.model_validate(entry("cable_sag", linear_density=density))]
    testbed = COGIRO.model_copy(update={"effects": tuple(entries)})
    found = sagging_cables(testbed, POSE, np.full(8, density))
    parameters = nominal_parameters(testbed)
    limits = np.array([cable.tension_limits for cable in testbed.cables])
    straight = find_equilibrium(parameters, POSE, ORIGIN, limits).tensions
    load = static_wrench(read_actions(testbed), parameters, POSE, ORIGIN)
    heavy = find_equilibrium(parameters, POSE, ORIGIN, limits, load).tensions
    assert [each.straight for each in found] == pytest.approx(straight, rel=1e-9)
    assert (heavy - straight).min() > 100.0 * density
    grown = np.array([each.tension for each in found]) - straight
    assert grown == pytest.approx(heavy - straight, rel=0.02)


def test_heavier_cables_sag_more_and_are_softer():
    light, heavy = (sagging_cables(COGIRO, POSE, np.full(8, each)) for each in (0.02, 0.1))
    for before, after in zip(light, heavy, strict=True):
        assert after.sag > 4.0 * before.sag
        assert after.stiffness < before.stiffness < 1.0
        assert after.longer > before.longer > 0.0


def test_too_heavy_cables_and_pulleys_are_refused():
    with pytest.raises(ConvergenceError, match=r"^c\d: .* do not hold a cable of"):
        sagging_cables(COGIRO, POSE, np.full(8, 5.0))
    with pytest.raises(InputError) as caught:
        sagging_cables(build(pulley_content()), POSE, np.full(8, 0.01))
    assert str(caught.value) == (
        "general: c0 has a pulley or several parts, allowed: straight cables of one part"
    )
