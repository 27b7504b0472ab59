"""Tables of vessels that are in other units, or of no vessel."""

import numpy as np
import pytest
from scipy.io import savemat
from vessel_samples import GRAVITY, HEADINGS, SUPPLY, mss, small_body_vessel, written

from cspm_control.waves.sea import wave_number
from cspm_control.waves.small_body import small_body_response
from cspm_control.waves.vessel import read_vessel
from cspm_msgs_py.errors import InputError

FREQUENCY = np.linspace(0.1, 3.0, 20)


def response(frequency=FREQUENCY):
    number = wave_number(frequency, GRAVITY)
    return np.array([small_body_response(HEADINGS, np.full(len(HEADINGS), k)) for k in number])


def fault(tmp_path, vessel):
    path = written(tmp_path, vessel)
    with pytest.raises(InputError) as caught:
        read_vessel(path)
    assert str(caught.value).startswith(f"{path}: ")
    return str(caught.value).removeprefix(f"{path}: vessel.")


def changed(amplitude=lambda a: a, phase=lambda p: p, operator=None):
    """A vessel file whose six tables were changed."""
    operator = response() if operator is None else operator
    vessel = mss(FREQUENCY, HEADINGS, operator)
    for dof in range(6):
        amp, turned = vessel["motionRAO"]["amp"][0], vessel["motionRAO"]["phase"][0]
        amp[dof] = amplitude(amp[dof]) if dof > 2 else amp[dof]
        turned[dof] = phase(turned[dof])
    return vessel


def test_what_follows_long_waves_is_read(tmp_path):
    assert read_vessel(written(tmp_path, small_body_vessel(FREQUENCY))) is not None
    if SUPPLY.exists():
        assert read_vessel(SUPPLY) is not None


def test_phases_in_degrees_are_refused(tmp_path):
    wrapped = changed(phase=lambda p: np.degrees(np.angle(np.exp(1j * p))))
    assert fault(tmp_path, wrapped) == (
        "motionRAO.phase: in the longest wave, 0.1 rad/s, heave is that of the water only if the"
        " phases are degrees, allowed: rad"
    )
    unwrapped = changed(phase=lambda p: p + 40.0 * np.pi)
    assert read_vessel(written(tmp_path, unwrapped)) is not None


def test_a_heave_that_points_up_is_refused(tmp_path):
    assert fault(tmp_path, changed(operator=-response())) == (
        "motionRAO.phase: in the longest wave, 0.1 rad/s, heave is against the water, allowed: z"
        " down and the phase of the wave at the vessel's origin, so that heave tends to -1"
    )


def test_rotations_in_degrees_are_refused(tmp_path):
    assert fault(tmp_path, changed(amplitude=np.degrees)) == (
        "motionRAO.amp: in the longest wave, 0.1 rad/s, pitch is 57.3 times the slope of the wave,"
        " allowed: rad/m; degrees have to be converted"
    )
    assert read_vessel(written(tmp_path, changed(amplitude=lambda a: 3.0 * a))) is not None


@pytest.mark.parametrize("dof", range(6))
def test_a_side_with_the_wrong_sign_is_refused(tmp_path, dof):
    operator = response()
    operator[:, len(HEADINGS) // 2 + 1 :, dof] *= -1.0
    if dof == 2:  # then heave is not the water's either
        operator = operator * np.exp(0.6j)
    said = fault(tmp_path, changed(operator=operator))
    assert "as a vessel's is that is built alike to both sides" in said


def test_a_small_difference_between_the_sides_is_read(tmp_path):
    operator = response()
    operator[:, len(HEADINGS) // 2 + 1 :] *= 1.2
    assert read_vessel(written(tmp_path, changed(operator=operator))) is not None


def test_headings_in_degrees_are_named(tmp_path):
    vessel = changed() | {"headings": np.degrees(HEADINGS)}
    path = tmp_path / "vessel.mat"
    savemat(path, {"vessel": vessel})
    with pytest.raises(InputError, match=r"increasing rad in \[0, 2π\); these are degrees\?$"):
        read_vessel(path)
