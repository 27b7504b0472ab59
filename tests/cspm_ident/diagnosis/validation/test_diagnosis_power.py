"""The power that residuals stand for: whether what is missing takes energy or gives it."""

import numpy as np
import pytest

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.validation.residual_curves import Curve, held_out_curves
from cspm_ident.diagnosis.validation.residual_power import lost_powers
from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects import Channel, catalogue

TIMES = 0.01 * np.arange(4000)
RATE = np.cos(2.0 * TIMES)
SHAFT = Place(Channel.SHAFT, "surge_2")
RATES = {Channel.SHAFT: "speed [rad/s]", Channel.TENSION: "rate of elongation [m/s]"}


def curve(before, after, channel=Channel.SHAFT, name=None):
    signals = {name or RATES[channel]: RATE, "time [s]": TIMES}
    return Curve(Place(channel, "surge_2"), "", TIMES, before, before, after, signals, ())


@pytest.mark.parametrize("channel", [Channel.SHAFT, Channel.TENSION])
def test_a_damper_that_the_model_lacks_takes_what_it_turns_into_heat(channel):
    """Of a force c·v, c·⟨v²⟩; once it is modelled, nothing surely."""
    noise = 0.01 * np.random.default_rng(0).standard_normal(len(TIMES))
    (power,) = lost_powers([curve(0.3 * RATE + noise, noise, channel)])
    assert power.before == pytest.approx(0.3 * np.mean(RATE**2), rel=0.02)
    assert abs(power.after) < 2.0 * power.half < 0.005
    assert not power.gives


def test_what_gives_energy_is_distinguished_from_what_takes_it():
    (taken,) = lost_powers([curve(0.3 * RATE, 0.3 * RATE)])
    (given,) = lost_powers([curve(-0.3 * RATE, -0.3 * RATE)])
    assert (taken.gives, given.gives) == (False, True)
    # A spring takes and gives back.
    spring = 0.3 * np.sin(2.0 * TIMES)
    (stored,) = lost_powers([curve(spring, spring)])
    assert abs(stored.after) < 0.01
    assert not stored.gives


def test_drag_on_the_bar_takes_energy_in_every_component():
    """Drag is in M·ν̇ + h − g less the cables' wrench as −c·ν."""
    speeds = {f"{dof} speed [1/s]": np.cos((k + 1.0) * TIMES) for k, dof in enumerate(DOFS)}
    target = -0.2 * np.column_stack(list(speeds.values()))
    part = Equation(Place(Channel.WRENCH, "bar"), TIMES, target, {}, target, signals=speeds)
    (power,) = lost_powers(held_out_curves([[part]], {}))
    assert power.before == pytest.approx(0.2 * len(DOFS) / 2, rel=0.02)
    fewer = Equation(part.place, TIMES, target, {}, target, signals=dict([*speeds.items()][:2]))
    (power,) = lost_powers(held_out_curves([[fewer]], {}))
    assert power.before == pytest.approx(0.2, rel=0.02)


def test_stretches_and_recordings_count_by_their_length():
    rubbing = Candidate(catalogue()["winch_coulomb_friction"], "surge_2")

    def part(rows, torque):
        target = torque * np.sign(RATE[:rows])[:, None]
        column = np.sign(RATE[:rows])[:, None, None]
        signals = {"speed [rad/s]": RATE[:rows]}
        return Equation(SHAFT, TIMES[:rows], target, {rubbing: column}, target, signals=signals)

    parts = [[part(3000, 0.1)], [part(1000, 0.3)]]
    (power,) = lost_powers(held_out_curves(parts, {rubbing: np.array([0.1])}))
    spent = np.abs(RATE)
    taken = 0.1 * spent[:3000].sum() + 0.3 * spent[:1000].sum()
    assert power.before == pytest.approx(taken / 4000)
    assert power.after == pytest.approx(0.2 * spent[:1000].sum() / 4000)


def test_the_interval_holds_the_mean_of_noise_that_hangs_together():
    """Coloured noise of 0.5 s: in 100 draws 95 % intervals hold nothing lost in most of them."""
    rng, held = np.random.default_rng(1), 0
    for _ in range(100):
        rough = rng.standard_normal(len(TIMES) + 50)
        noise = np.convolve(rough, np.ones(51), "valid")
        (power,) = lost_powers([curve(noise, noise)])
        held += abs(power.after) <= power.half
    assert 88 <= held <= 99


def test_without_a_rate_there_is_no_power():
    assert lost_powers([curve(RATE, RATE, name="tension [N]")]) == ()
    assert lost_powers([curve(RATE, RATE, Channel.DRIVE, "speed [rad/s]")]) == ()
    one = Curve(SHAFT, "", TIMES[:1], RATE[:1], RATE[:1], RATE[:1], {"speed [rad/s]": RATE[:1]}, ())
    (power,) = lost_powers([one])
    assert power.half == np.inf
    assert not power.gives
