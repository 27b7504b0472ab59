import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cspm_control.controllers.torque_profile import TorqueGenerator
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.scenario import Signal, Sine

CABLES = ["a", "b", "c"]


@given(stamp_ns=st.integers(0, 10**12))
def test_offset_plus_sines_by_cable(stamp_ns):
    sines = (
        Sine(amplitude=0.3, frequency=0.5, phase=0.2),
        Sine(amplitude=-0.1, frequency=7.0),
        Sine(amplitude=0.05, frequency=0.5),
    )
    signals = {"c": Signal(offset=0.7, sines=sines), "a": Signal(offset=-0.2)}
    torque = TorqueGenerator(signals, CABLES).step(stamp_ns)
    time = stamp_ns * 1e-9
    expected = 0.7 + sum(
        s.amplitude * np.sin(2 * np.pi * s.frequency * time + s.phase) for s in sines
    )
    np.testing.assert_allclose(torque, [-0.2, 0.0, expected], atol=1e-9)


def test_a_quarter_period_is_the_amplitude():
    signal = Signal(offset=1.0, sines=(Sine(amplitude=0.25, frequency=5.0),))
    generator = TorqueGenerator({"b": signal}, CABLES)
    np.testing.assert_allclose(generator.step(50_000_000), [0.0, 1.25, 0.0], atol=1e-12)
    np.testing.assert_allclose(generator.step(0), [0.0, 1.0, 0.0])


def test_no_signal_is_no_torque():
    np.testing.assert_array_equal(TorqueGenerator({}, CABLES).step(10**9), np.zeros(3))


def test_a_signal_for_no_cable_is_refused():
    with pytest.raises(InputError) as caught:
        TorqueGenerator({"d": Signal()}, CABLES)
    assert str(caught.value) == "control.torque.d: no such cable, allowed: a, b, c"
