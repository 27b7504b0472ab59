"""What controllers make of sensors' noise is nothing that the machine lacks."""

from pathlib import Path

import numpy as np
import pytest
from run_samples import SCENARIOS

from bench.blind.concealed_run import record_concealed
from bench.blind.reality.reality import conceal
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.reporting.verdict import Verdict, verdict_of
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.validation.instrumental_variables import (
    instruments_of,
    is_proportional,
    shows_in_reference_motion,
)
from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.scenario import parse_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_sim.effects import Channel, catalogue

THESIS = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml")
PLACE = Place(Channel.SHAFT, "only")
INERTIA, GAIN = (
    Candidate(catalogue()[name], "only") for name in ("winch_inertia", "winch_torque_gain")
)
TIMES = 0.01 * np.arange(6000)
ASKED = np.sin(2.1 * TIMES) + 0.6 * np.sin(0.83 * TIMES)
WANTED = Samples(TIMES, ASKED[:, None])


def shows(motion, *, missing, fed_back, beside=0.0, wanted=WANTED):
    """A residual of noise to which the motion responds, with as much of the motion missing."""
    noise = np.random.default_rng(1).standard_normal(len(TIMES))
    moved = motion * ASKED + fed_back * noise
    other = np.cos(1.3 * TIMES)
    target = noise + missing * moved + beside * other
    columns = {INERTIA: moved[:, None, None], GAIN: other[:, None, None]}
    part = Equation(PLACE, TIMES, target[:, None], columns, target[:, None])
    fitted = np.linalg.lstsq(np.column_stack([moved, other]), target, rcond=None)[0]
    weights = {INERTIA: fitted[:1], GAIN: fitted[1:]}
    return shows_in_reference_motion([[part]], [wanted], [INERTIA], weights, 0.5)


def test_what_only_answers_noise_does_not_show():
    """Motion in proportion to the residual's noise explains all of it, and nothing is missing."""
    assert not shows(0.0, missing=0.0, fed_back=0.3)
    assert not shows(1.0, missing=0.0, fed_back=0.3)
    # Of what was reported a part is there; the number is that of the noise.
    assert not shows(1.0, missing=0.05, fed_back=0.3)
    # What is there and what is fed back make up to the wrong sign.
    assert not shows(1.0, missing=-0.2, fed_back=0.3)


@pytest.mark.parametrize("missing", [0.2, -0.2])
def test_what_is_missing_shows_whatever_is_fed_back(missing):
    assert shows(1.0, missing=missing, fed_back=0.05)
    assert shows(1.0, missing=missing, fed_back=0.0, beside=5.0)
    assert not shows(1.0, missing=0.0, fed_back=0.3, beside=5.0)


def test_without_a_reference_a_finding_has_to_show_in_its_own_slow_part():
    """Noise that is fed back is in neighbouring rows alone, and motion is not."""
    assert not shows(0.0, missing=0.0, fed_back=0.3, wanted=None)
    assert not shows(1.0, missing=0.0, fed_back=3.0, wanted=None)
    assert shows(1.0, missing=0.2, fed_back=0.05, wanted=None)


def test_an_equation_of_few_rows_has_a_slow_part_too():
    short = Equation(
        PLACE, TIMES[:3], ASKED[:3, None], {INERTIA: ASKED[:3, None, None]}, ASKED[:3, None]
    )
    assert shows_in_reference_motion([[short]], [None], [INERTIA], {INERTIA: np.ones(1)}, 0.5)


def test_winches_that_stand_still_feed_nothing_back():
    rng = np.random.default_rng(2)
    still = 1e-5 * rng.standard_normal((len(TIMES), 8))
    asked = Measurement(Path("today"), "ab" * 32, THESIS, wanted=WANTED)
    moved = still + ASKED[:, None]
    assert instruments_of(asked.with_samples("angle", Samples(TIMES, still))) is None
    assert instruments_of(asked.with_samples("angle", Samples(TIMES, moved))) is WANTED
    assert instruments_of(asked) is None


@pytest.mark.parametrize(
    ("asked", "pushed", "used"), [(0.1, 0.0, True), (0.1, 0.02, True), (0.0, 0.02, False)]
)
def test_a_bar_that_is_pushed_by_hand_moves_without_noise(asked, pushed, used):
    """Two centimetres beside ten that were asked for are an error of tracking."""
    rng = np.random.default_rng(3)
    pose = 5e-5 * rng.standard_normal((len(TIMES), 6))
    pose[:, 0] += asked * ASKED + pushed * np.cos(1.7 * TIMES)
    angle = Samples(TIMES, 40.0 * pose[:, :1])
    known = Measurement(Path("today"), "ab" * 32, THESIS, wanted=WANTED, angle=angle)
    instruments = instruments_of(known.with_samples("bar_pose", Samples(TIMES, pose)))
    assert (instruments is WANTED) is used


@pytest.mark.parametrize(
    ("effect", "proportional"),
    [
        ("winch_inertia", True),
        ("pose_delay", True),
        ("frame_flexibility", True),
        ("winch_coulomb_friction", False),
        ("winch_torque_ripple", False),
        ("cable_hysteresis", False),
    ],
)
def test_what_hangs_on_a_direction_or_a_place_is_not_proportional(effect, proportional):
    assert is_proportional(catalogue()[effect]) is proportional


def alone():
    """A winch frame in a sea, and a bar that has to stay where it is."""
    frame = {"type": "jonswap", "peak_period": 1.19, "heading": 0.7, "band": [0.506, 1.52]}
    frame |= {"amplitudes": [0.01, 0.01, 0.015, 2e-4, 2e-4, 2e-4], "period": 30.0, "ramp": 4.0}
    content = {
        "name": "alone",
        "testbed": "thesis.yaml",
        "duration": 30.0,
        "seed": 5,
        "winch_frame": {"motion": frame},
        "target": {"mean_pose": [0.0, 0.0, 1.8, 0.0, 0.0, 0.0]},
    }
    return parse_scenario(dump_yaml(content), "alone")


@pytest.mark.slow
def test_a_healthy_machine_whose_bar_stands_still_is_consistent(tmp_path):
    """Of what stands still sensors see noise alone, which motion control follows."""
    pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
    scenario = resolve(alone(), THESIS.testbed)
    bundle = make_bundle(scenario, THESIS, SCENARIOS / "testbeds")
    healthy = conceal(THESIS.testbed, {}, 0.0, 6)
    record_concealed(
        bundle, healthy, tmp_path / "healthy", note="", without=(), progress=lambda now: None
    )
    found = diagnose([read_measurement(tmp_path / "healthy")])
    assert verdict_of(found) is Verdict.CONSISTENT
    assert any(is_proportional(each.hypothesis.effect) for each in found.rejected)
