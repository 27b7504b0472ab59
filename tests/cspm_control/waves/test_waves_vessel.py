import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat
from vessel_samples import GRAVITY, HEADINGS, SUPPLY, mss, small_body_vessel, written

from cspm_control.waves.sea import wave_number
from cspm_control.waves.small_body import small_body_response
from cspm_control.waves.vessel import read_vessel
from cspm_msgs_py.errors import InputError


@pytest.fixture
def supply():
    if not SUPPLY.exists():
        pytest.skip("the supply vessel's response is not at hand")
    return read_vessel(SUPPLY)


EVEN = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])


def like_a_vessel(operator):
    """Any response, made alike to both sides; headings as in `HEADINGS`."""
    return operator + EVEN * operator[:, -np.arange(operator.shape[1])]


def test_reads_amplitude_and_phase_of_the_first_speed(tmp_path):
    generator = np.random.default_rng(0)
    frequency = np.array([0.2, 0.5, 0.9])
    operator = generator.normal(size=(3, 36, 6)) + 1j * generator.normal(size=(3, 36, 6))
    operator = like_a_vessel(operator)
    vessel = read_vessel(written(tmp_path, mss(frequency, HEADINGS, operator)))
    assert vessel.operator == pytest.approx(operator)
    at = vessel.at(frequency, HEADINGS[[0, 13, 35]], 1.0)
    assert at == pytest.approx(operator[[0, 1, 2], [0, 13, 35]])


def test_interpolates_real_and_imaginary_parts_round_the_circle(tmp_path):
    generator = np.random.default_rng(1)
    operator = generator.normal(size=(2, 36, 6)) + 1j * generator.normal(size=(2, 36, 6))
    operator = like_a_vessel(operator)
    vessel = read_vessel(written(tmp_path, mss(np.array([0.2, 0.6]), HEADINGS, operator)))
    relative = np.radians([355.0, -5.0, 715.0])
    expected = 0.5 * (operator[0, 35] + operator[0, 0])
    assert vessel.at(np.full(3, 0.2), relative, 1.0) == pytest.approx(np.tile(expected, (3, 1)))
    between = vessel.at(np.array([0.3]), np.zeros(1), 1.0)[0]
    assert between == pytest.approx(0.75 * operator[0, 0] + 0.25 * operator[1, 0])


def test_headings_that_do_not_start_at_zero_wrap_too(tmp_path):
    heading = HEADINGS + np.radians(5.0)
    even, odd = np.cos(heading), 1j * np.sin(heading)
    operator = np.tile(np.stack([even, odd] * 3, axis=1), (2, 1, 1))
    vessel = read_vessel(written(tmp_path, mss(np.array([0.2, 0.6]), heading, operator)))
    for angle in (0.0, 0.01, 3.0, 6.28):
        at = vessel.at(np.array([0.4]), np.array([angle]), 1.0)[0]
        expected = np.array([np.cos(angle), 1j * np.sin(angle)] * 3)
        assert at == pytest.approx(expected, abs=5e-3)


@pytest.mark.parametrize("scale", [1.0, 12.0, 50.0])
def test_froude_scaling_keeps_the_law_of_a_small_body(tmp_path, scale):
    vessel = read_vessel(written(tmp_path, small_body_vessel(np.linspace(0.1, 2.0, 96))))
    omega = np.array([0.3, 0.8, 1.5]) * np.sqrt(scale)
    direction = np.radians([0.0, 50.0, 230.0])
    expected = small_body_response(direction, wave_number(omega, GRAVITY))
    # Linear interpolation of k = ω²/g on 0.02 rad/s is off by at most 1e-5·scale.
    assert vessel.at(omega, direction, scale) == pytest.approx(expected, abs=2e-5 * scale)


def test_frequencies_outside_the_table_are_refused(tmp_path):
    vessel = read_vessel(written(tmp_path, small_body_vessel(np.linspace(0.1, 2.0, 20))))
    assert vessel.at(np.array([0.1, 2.0]), np.zeros(2), 1.0).shape == (2, 6)
    for omega in (0.09, 2.1):
        with pytest.raises(InputError) as caught:
            vessel.at(np.array([1.0, omega]) * 2.0, np.zeros(2), 4.0)
        assert str(caught.value).endswith("allowed: a band inside 0.03183 to 0.6366 Hz at scale 4")


class TestSupplyVessel:
    def test_floats_on_long_waves(self, supply):
        lowest = supply.operator[0]
        assert np.abs(lowest[:, 2]) == pytest.approx(np.ones(36), abs=1e-3)

    def test_obeys_the_signs_of_a_small_body_on_long_waves(self, supply):
        number = wave_number(supply.angular_frequency, GRAVITY)
        law = small_body_response(supply.heading, np.full(36, number[0]))
        actual = supply.operator[0]
        assert actual[:, :3] == pytest.approx(law[:, :3], abs=0.01)
        assert actual[:, 4] == pytest.approx(law[:, 4], abs=0.05 * number[0])
        assert actual[:, 5] == pytest.approx(law[:, 5], abs=0.2 * number[0])
        # Roll is magnified on its way to resonance, its sign is that of the slope.
        beam = 9
        assert np.angle(actual[beam, 3] / law[beam, 3]) == pytest.approx(0.0, abs=0.02)

    def test_roll_lags_through_its_resonance(self, supply):
        """The sign of the phase: with the other one, roll would lead the waves that drive it."""
        beam = supply.operator[:, 9, 3]
        peak = np.argmax(np.abs(beam) / wave_number(supply.angular_frequency, GRAVITY))
        angle = np.unwrap(np.angle(beam / beam[0]))
        assert 0 < peak < 20
        assert (np.diff(angle[: peak + 4]) < 0).all()
        assert angle[peak + 4] < -1.0

    def test_returns_its_own_table(self, supply):
        at = supply.at(supply.angular_frequency[[3, 10]], supply.heading[[4, 31]], 1.0)
        assert at == pytest.approx(supply.operator[[3, 10], [4, 31]])


def faulty(change):
    vessel = small_body_vessel(np.linspace(0.1, 2.0, 20))
    change(vessel)
    return vessel


def negative(vessel):
    vessel["motionRAO"]["amp"][0, 1][2, 2, 0] = -1.0


def endless(vessel):
    vessel["motionRAO"]["phase"][0, 1][2, 2, 0] = np.nan


def one_dof_less(vessel):
    vessel["motionRAO"]["amp"] = vessel["motionRAO"]["amp"][:, :5]


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (
            lambda v: v.pop("motionRAO"),
            "allowed: a struct `vessel` with `headings` and `motionRAO`",
        ),
        (lambda v: v.pop("headings"), "allowed: a struct `vessel` with `headings` and `motionRAO`"),
        (lambda v: v["motionRAO"].pop("phase"), "vessel.motionRAO: allowed: `w` and six arrays"),
        (lambda v: v["motionRAO"].update(w=np.array([0.1, 0.2])), "vessel.motionRAO: allowed: `w`"),
        (lambda v: v["motionRAO"].update(amp="much"), "vessel.motionRAO: allowed: `w` and six"),
        (one_dof_less, "vessel.motionRAO: allowed: `w` and six arrays"),
        (negative, "vessel.motionRAO: allowed: finite phases, amplitudes ≥ 0"),
        (endless, "vessel.motionRAO: allowed: finite phases, amplitudes ≥ 0"),
        (
            lambda v: v["motionRAO"].update(w=np.linspace(2.0, 0.1, 20)),
            "vessel.motionRAO.w: allowed",
        ),
        (lambda v: v.update(headings=np.arange(36) * 10.0), "vessel.headings: allowed: increasing"),
        (
            lambda v: v.update(headings=HEADINGS / 2),
            "vessel.headings: a gap of 3.23 rad, allowed: at",
        ),
    ],
)
def test_files_without_a_plausible_table_are_refused(tmp_path, change, fault):
    path = written(tmp_path, faulty(change))
    with pytest.raises(InputError) as caught:
        read_vessel(path)
    assert str(caught.value).startswith(f"{path}: {fault}")


def test_other_files_are_refused_in_one_line(tmp_path):
    with pytest.raises(InputError, match="no such file, allowed: a MATLAB file of a vessel"):
        read_vessel(tmp_path / "absent.mat")
    with pytest.raises(InputError, match="no such file"):
        read_vessel(tmp_path)
    savemat(tmp_path / "other.mat", {"ship": 1.0})
    with pytest.raises(InputError, match="allowed: a struct `vessel`"):
        read_vessel(tmp_path / "other.mat")
    whole = written(tmp_path, small_body_vessel(np.linspace(0.1, 2.0, 20))).read_bytes()
    (tmp_path / "cut.mat").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="not readable as MATLAB file"):
        read_vessel(tmp_path / "cut.mat")


@settings(max_examples=100, deadline=None)
@given(content=st.binary(max_size=300), header=st.booleans())
def test_garbage_is_refused_in_one_line(tmp_path_factory, content, header):
    path = tmp_path_factory.getbasetemp() / "garbage.mat"
    start = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" if header else b""
    path.write_bytes(start + content)
    with pytest.raises(InputError) as caught:
        read_vessel(path)
    assert "\n" not in str(caught.value)
