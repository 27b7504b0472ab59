"""Tensions that alternate from one reading to the next, and what is doubtful then."""

import numpy as np
import pytest
from run_samples import SCENARIOS

from cspm_ident.diagnosis.finding import Finding, Status, reported_status
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis
from cspm_ident.diagnosis.reporting.statement import line_statement
from cspm_ident.diagnosis.residuals.aliased_tension import chatters_of
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.testbed import load_testbed
from cspm_sim.effects import catalogue

THESIS = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml")
N, STEP = 4000, 1e-3
TIMES = STEP * np.arange(N)
SEA = 5.0 + np.sin(2.0 * TIMES)
SWING = (-1.0) ** np.arange(N)
NOISE = np.random.default_rng(3).standard_normal(N + 1)


def recorded(first):
    """A recording in which the first cable's tension is as given, and the others' follow a sea."""
    others = np.tile((SEA + 0.02 * NOISE[1:])[:, None], 7)
    tensions = np.column_stack([first, others])
    return Measurement(SCENARIOS, "ab" * 32, THESIS, tension=Samples(TIMES, tensions))


@pytest.mark.parametrize(
    "first",
    [
        SEA,
        np.full(N, 5.0),
        5.0 + NOISE[1:],
        # Noise that rises with the frequency, as of something differentiated, is noise still.
        SEA + np.diff(NOISE),
        SEA + np.sin(2.0 * np.pi * 120.0 * TIMES),
        # Of less than half of the tension: no slack.
        SEA + 0.02 * NOISE[1:] + 2.4 * SWING,
    ],
)
def test_what_is_smooth_or_noise_or_slower_does_not_alternate(first):
    assert chatters_of(recorded(first)) == ()


@pytest.mark.parametrize("frequency", [420.0, 500.0])
def test_what_swings_faster_than_it_is_read_is_reported(frequency):
    swing = 4.0 * np.cos(2.0 * np.pi * frequency * TIMES)
    (line,) = chatters_of(recorded(SEA + swing + 0.02 * NOISE[1:]))
    assert (line.place.element, line.frequency) == ("hoist_1", pytest.approx(500.0))
    said = line_statement(line)
    assert said.startswith("The tension of cable hoist_1 alternates from one reading to the next")
    assert "comes from outside" not in said


def test_its_amplitude_is_reported():
    for amplitude in (4.0, 2.6):
        (line,) = chatters_of(recorded(SEA + amplitude * SWING))
        assert line.amplitude == pytest.approx(amplitude, rel=1e-3)


def test_without_load_cells_nothing_alternates():
    assert chatters_of(Measurement(SCENARIOS, "ab" * 32, THESIS)) == ()


@pytest.mark.parametrize(
    ("effect", "element", "doubtful"),
    [
        ("tension_gain", "hoist_1", True),
        ("tension_gain", "hoist_2", False),
        ("bar_mass", "bar", True),
        ("frame_flexibility", "winch_frame", True),
    ],
)
def test_what_is_reported_by_readings_that_alternate_is_doubtful(effect, element, doubtful):
    own = catalogue()[effect]
    finding = Finding(Hypothesis(own, (Candidate(own, element),)), Gain(9000.0, 10.0), 0.9)
    assert (reported_status(finding, {"hoist_1"}) is Status.DOUBTFUL) is doubtful
    assert reported_status(finding) is Status.REPORTED
