"""Encoders against measured poses, without torque or tension."""

from dataclasses import replace

import numpy as np
import pytest
from run_samples import run_to

from cspm_ident.lengths.identify_lengths import SCALE, identify_lengths
from cspm_ident.signals.measurement import read_measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.errors import InputError


@pytest.fixture(scope="module")
def posed(tmp_path_factory):
    """Fifteen seconds in which cables move by half a metre: poses and motor angles alone."""
    folder = tmp_path_factory.mktemp("posed") / "bag"
    run_to(folder, "calm", "duration=15", "sensors=ideal")
    whole = read_measurement(folder)
    return replace(whole, torque=None, tension=None, speed=None, command=None)


def scaled(measurement, index, factor):
    values = measurement.angle.values.copy()
    values[:, index] = values[0, index] + factor * (values[:, index] - values[0, index])
    return measurement.with_samples("angle", Samples(measurement.angle.times, values))


@pytest.mark.parametrize("factor", [1.06, 0.94])
def test_a_scale_of_six_per_cent_is_found_on_its_cable_alone(posed, factor):
    result = identify_lengths([scaled(posed, 4, factor)])
    wrong = result.cables[4]
    assert [cable.name for cable in result.cables if cable.is_off] == [wrong.name]
    assert wrong.estimate.value(SCALE) == pytest.approx(1.0 / factor, rel=0.01)
    ((_, _, before, after),) = wrong.errors
    assert after < 0.3 * before


def test_a_right_encoder_is_not_off(posed):
    result = identify_lengths([posed])
    assert not any(cable.is_off for cable in result.cables)
    assert result.objections == ()


def test_an_angle_of_the_other_sign_is_no_result(posed):
    result = identify_lengths([scaled(posed, 0, -1.0)])
    (text,) = result.objections
    assert text.startswith(f"{result.cables[0].name}: no result: scale -")
    assert text.endswith("check the sign of the angle: positive winds in")


def test_what_is_missing_is_named(posed):
    with pytest.raises(InputError, match="lengths need /winches/state position, allowed: "):
        identify_lengths([replace(posed, angle=None)])
    still = Samples(posed.angle.times, np.ones_like(posed.angle.values))
    with pytest.raises(InputError, match="no winch moves, allowed: recordings in which one does"):
        identify_lengths([posed.with_samples("angle", still)])
