"""Signs of inertia, friction and the cable's pull in a winch's torque."""

import numpy as np
import pytest

from cspm_checks.drive_balance import drive_balance
from cspm_checks.relations import balance_suspicions
from cspm_checks.series import SensorSeries

INERTIA, VISCOUS, COULOMB = 0.0095, 0.02, 0.2


def winch(seed=0, *, pull=0.0, friction=1.0, inertia=INERTIA, count=6000, step=2e-3):
    """Angle, torque and pull of a winch that several sines move."""
    rng = np.random.default_rng(seed)
    t = step * np.arange(count)
    tones = [(rng.uniform(1.0, 20.0), rng.uniform(0, 6), 2.0 / (k + 1)) for k in range(5)]
    angle = sum(size * np.sin(w * t + phase) for w, phase, size in tones)
    speed = sum(size * w * np.cos(w * t + phase) for w, phase, size in tones)
    acceleration = sum(-size * w * w * np.sin(w * t + phase) for w, phase, size in tones)
    load = pull * (40.0 + 15.0 * np.sin(3.3 * t + 1.0) + rng.normal(0.0, 0.05, count))
    torque = inertia * acceleration + friction * (VISCOUS * speed + COULOMB * np.sign(speed)) + load
    torque += rng.normal(0.0, 0.01, count)
    series = (SensorSeries(t, values) for values in (torque, angle, load))
    return tuple(series)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("pull", [0.0, 0.025])
def test_what_was_put_in_is_found(seed, pull):
    torque, angle, load = winch(seed, pull=pull)
    found = drive_balance(torque, angle, load if pull else None, elastic=False)
    assert found.inertia.mean == pytest.approx(INERTIA, rel=0.05)
    assert found.friction.mean > 0.05
    assert (found.drum is None) == (pull == 0.0)
    if pull:
        assert found.drum.mean == pytest.approx(1.0, abs=0.05)
    assert balance_suspicions("w", found) == []


@pytest.mark.parametrize("pull", [0.0, 0.025])
@pytest.mark.parametrize("friction", [0.0, 1.0])
def test_a_wrong_sign_is_reported_with_friction_and_without(pull, friction):
    torque, angle, load = winch(pull=pull, friction=friction)
    for turned, other in ((torque, angle._replace(values=-angle.values)), (-1, angle)):
        signal = torque._replace(values=-torque.values) if isinstance(turned, int) else turned
        found = drive_balance(signal, other, load if pull else None, elastic=False)
        assert "power" in {one.kind for one in balance_suspicions("w", found)}


def test_friction_that_seems_negative_beside_a_healthy_inertia_is_not_reported():
    torque, angle, _ = winch(friction=-0.3)
    found = drive_balance(torque, angle, None, elastic=False)
    assert found.friction.mean < -0.05
    assert balance_suspicions("w", found) == []
    slow = winch(friction=-1.0, inertia=0.0)
    found = drive_balance(slow[0], slow[1], None, elastic=False)
    assert [one.kind for one in balance_suspicions("w", found)] == ["power"]


@pytest.mark.parametrize(
    ("factor", "reported"), [(0.3, True), (0.6, False), (1.8, False), (3.0, True)]
)
def test_a_torque_that_is_not_the_pull_is_reported(factor, reported):
    torque, angle, load = winch(pull=0.025)
    wrong = load._replace(values=load.values / factor)
    found = drive_balance(torque, angle, wrong, elastic=False)
    kinds = [one.kind for one in balance_suspicions("w", found)]
    assert kinds == (["torque"] if reported else [])
    assert found.drum.mean == pytest.approx(factor, rel=0.1)


@pytest.mark.parametrize("size", [1.0, 0.2])
def test_a_loop_that_answers_its_load_cells_noise_is_not_reported(size):
    """Torque has ten times the noise of the pull, and is right on average unless scaled."""
    torque, angle, load = winch(pull=0.025)
    noise = np.random.default_rng(3).normal(0.0, 1.0, len(load.values))
    loop = torque._replace(values=torque.values + 10.0 * noise)
    measured = load._replace(values=load.values + noise)
    found = drive_balance(
        loop, angle, measured._replace(values=measured.values * size), elastic=False
    )
    assert found.drum.mean > 2.0
    assert found.level == pytest.approx(1.0 / size, rel=0.1)
    kinds = [one.kind for one in balance_suspicions("w", found)]
    assert kinds == ([] if size == 1.0 else ["torque"])


def test_a_pull_that_is_none_on_average_has_no_level():
    torque, angle, load = winch(pull=0.025)
    swing = load._replace(values=load.values - load.values.mean())
    assert drive_balance(torque, angle, swing, elastic=False).level is None
    assert drive_balance(torque, angle, None, elastic=False).level is None


def test_what_does_not_move_or_is_short_is_not_judged():
    torque, angle, _ = winch()
    still = angle._replace(values=0.0 * angle.values)
    assert drive_balance(torque, still, None, elastic=False) is None
    assert (
        drive_balance(torque._replace(values=0.0 * torque.values), angle, None, elastic=False)
        is None
    )
    few = slice(1500)
    short = (SensorSeries(one.time[few], one.values[few]) for one in (torque, angle))
    assert drive_balance(*short, None, elastic=False) is None
