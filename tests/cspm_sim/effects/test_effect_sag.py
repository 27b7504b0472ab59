"""A cable with weight, in the plant and in what a regression reads."""

import numpy as np
import pytest
from creep_samples import LENGTH_M, MS, STILL, line, stiffness_of
from machines import LINEAR, entry
from scipy.optimize import brentq

from cspm_model.motion import Motion
from cspm_sim.effects import catalogue
from cspm_sim.effects.signals import EndSignal
from cspm_sim.plant import Plant

SAG_END = (LENGTH_M, 0.0, 0.0)
STIFF = {**LINEAR, "youngs_modulus": 2e11}


@pytest.mark.parametrize("spare", [5e-4, 2e-3, 1e-2])
def test_a_hanging_cable_carries_what_a_catenary_does(spare):
    """A cable longer than its span: 2a·sinh(l/2a) = l0 + stretch, t = w·a."""
    plant = Plant(line([entry("cable_sag", linear_density=0.05)], SAG_END, STIFF), STILL, MS)
    plant.unstretched_lengths[:] = LENGTH_M + spare
    plant._observe()
    weight, law = 0.05 * 9.81, plant.testbed.cables[0]
    give = weight * (LENGTH_M + spare + law.offset_length) / law.stiffness.axial_rigidity

    def excess(a):
        return 2 * a * np.sinh(LENGTH_M / (2 * a)) - LENGTH_M - spare - give * a

    a = brentq(excess, 0.5, 40.0)
    # The parabola's arc and its even tension differ by (l/a)²/20 and less.
    assert plant.tensions[0] == pytest.approx(weight * a, rel=(LENGTH_M / a) ** 2 / 20 + 1e-6)


@pytest.mark.parametrize("tension", [0.5, 1.0, 5.0])
def test_a_hanging_cable_is_softer_by_irvines_ratio(tension):
    """dt/dl = k/(1 + λ), λ = k·w²·l³/(12·t³)."""
    machine = line([entry("cable_sag", linear_density=0.005)], SAG_END)
    shifted = [Motion.still(np.array([side, 0, 0, 0, 0, 0])) for side in (-1e-6, 1e-6)]
    plant = Plant(machine, STILL, MS, tensions=[tension])
    assert plant.tensions[0] == pytest.approx(tension, abs=1e-8)
    k = stiffness_of(machine, plant.unstretched_lengths[0])
    found = []
    for motion in shifted:
        plant.frame[:] = motion.at(0.0)
        plant._observe()
        found.append(plant.tensions[0])
    softer = k * (0.005 * 9.81) ** 2 * LENGTH_M**3 / (12 * tension**3)
    # The sag's own dependence on the span is left out: 3·(arc − span)/l, below 1 %.
    assert (found[0] - found[1]) / 2e-6 == pytest.approx(k / (1 + softer), rel=1e-2)


def test_a_vertical_cable_does_not_sag():
    plant = Plant(line([entry("cable_sag", linear_density=0.05)]), STILL, MS)
    plant.unstretched_lengths[:] = LENGTH_M + 1e-3
    plant._observe()
    assert plant.tensions[0] == 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_upper_end_of_a_cable_carries_half_of_its_weight_more_than_its_middle(side):
    """The law's tension is the middle's; the exit is the upper end where the cable runs down."""
    end = (0.0, 0.0, side * LENGTH_M)
    bare, heavy = (
        Plant(line(effects, end), STILL, MS, tensions=[20.0])
        for effects in ([], [entry("cable_sag", linear_density=0.05)])
    )
    heavy.unstretched_lengths[:] = bare.unstretched_lengths
    heavy._observe()
    more = side * 0.5 * 0.05 * 9.81 * LENGTH_M
    assert heavy.tensions[0] - bare.tensions[0] == pytest.approx(more, rel=1e-6)


@pytest.mark.parametrize("direction", [(0.6, 0.0, 0.8), (0.0, 1.0, 0.0), (0.0, 0.6, -0.8)])
def test_the_bar_is_pulled_by_what_the_exit_carries_less_the_weight_between(direction):
    """By statics: less by w·l along the cable, and half of w·l across it."""
    along, weight, down = np.array(direction), 9.81 * LENGTH_M, np.array([0.0, 0.0, 1.0])
    signals = np.zeros((1, len(EndSignal) + 6))
    signals[0, EndSignal.DIRECTION : EndSignal.DIRECTION + 3] = along
    signals[0, EndSignal.LENGTH], signals[0, EndSignal.GRAVITY] = LENGTH_M, 9.81
    (partner,) = catalogue()["cable_sag"].signature.partners
    force = partner.columns(signals)[0, :3, 1]
    share = down @ along
    expected = weight * share * along + 0.5 * weight * (down - share * along)
    assert force == pytest.approx(expected)


@pytest.mark.parametrize(
    ("weights", "density"),
    [((4e-4, 0.01), 0.01), ((4e-4, -0.01), 0.0), ((4e-4, 0.0), 0.02), ((-1e-4, 0.0), 0.0)],
)
def test_density_is_identified_by_weight_and_by_sag_where_none_shows(weights, density):
    assert catalogue()["cable_sag"].values(weights) == {"linear_density": pytest.approx(density)}
