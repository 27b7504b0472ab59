"""What data that were not searched say of a finding."""

from dataclasses import replace

import numpy as np
import pytest
from measured_samples import measured_with
from run_samples import PLUCKED_IN_SURGE

from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.finding import HoldOut, Rejection, Status
from cspm_ident.diagnosis.regression.block_gram import gather
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.validation.holdout_test import holdout_tested
from cspm_sim.effects import Channel, catalogue

ROWS, STEP, BLOCK_S = 2400, 0.01, 0.5
AIR = """  - effect: bar_quadratic_drag
    parameters: {surge: 40.0, sway: 40.0, heave: 0.0, roll: 0.0, pitch: 0.0, yaw: 0.0}
"""
DRAG = Candidate(catalogue()["winch_viscous_friction"], "surge_1")


def winch(weight, loud=1.0, rows=ROWS, seed=1):
    """A winch with viscous friction, in hundredths, that moves by `loud`, in units of its noise."""
    rng = np.random.default_rng(seed)
    times = STEP * np.arange(rows)
    speed = loud * (np.sin(2.1 * times) + 0.6 * np.sin(0.83 * times))
    target = (weight * speed + rng.standard_normal(rows))[:, None]
    columns = {DRAG: 100.0 * speed[:, None, None]}
    return gather(
        [[Equation(Place(Channel.SHAFT, "surge_1"), times, target, columns, target)]], 0.5
    )


@pytest.mark.parametrize(
    ("weight", "loud", "holdout"),
    [
        (1.0, 1.0, HoldOut.CONFIRMED),
        # There it takes most.
        (1.0, 2.0, HoldOut.DOMINANT),
        # Where it moves a fifth as much it takes two hundredths, which is what it should.
        (1.0, 0.2, HoldOut.FAINT),
        # There it takes none though it should.
        (0.0, 0.2, None),
        (0.0, 1.0, None),
        # Half of it would lower as much as the rest raises.
        (0.5, 1.0, HoldOut.UNDECIDED),
        # It moves so little that what it takes says nothing.
        (1.0, 0.02, HoldOut.SILENT),
    ],
)
def test_a_finding_is_accepted_by_what_it_should_take(weight, loud, holdout):
    search = Search(winch(1.0))
    (found,) = search.run().findings
    (tested,) = holdout_tested(search.fits, winch(weight, loud, seed=2), [found])
    if holdout is None:
        assert (tested.status, tested.rejection) == (Status.REJECTED, Rejection.HOLDOUT_TEST)
    else:
        assert (tested.status, tested.holdout) == (Status.REPORTED, holdout)
    assert tested.hypothesis is found.hypothesis


def test_of_several_findings_those_stand_that_are_confirmed():
    search = Search(winch(1.0))
    (found,) = search.run().findings
    (tested,) = holdout_tested(search.fits, winch(-1.0, seed=2), [found])
    assert tested.rejection is Rejection.HOLDOUT_TEST
    assert holdout_tested(search.fits, winch(1.0, seed=2), []) == ()


def test_data_without_any_residual_say_nothing():
    search = Search(winch(1.0))
    (found,) = search.run().findings
    nothing = replace(winch(1.0), places=())
    (tested,) = holdout_tested(search.fits, nothing, [found])
    assert tested.holdout is HoldOut.SILENT


@pytest.mark.slow
def test_drag_of_a_bar_that_has_come_to_rest_is_reported_with_that_nothing_confirms_it(tmp_path):
    """In the last three tenths of a minute a plucked bar shows nothing, which confirms nothing."""
    measured = measured_with(
        AIR, tmp_path / "plucked", "verification_mid", "duration=60", PLUCKED_IN_SURGE
    )
    found = diagnosis_data(diagnose([measured]))
    (reported,) = found["findings"]
    assert (found["verdict"], reported["effect"]) == ("effect", "bar_quadratic_drag")
    assert reported["statement"].endswith(
        "What was not searched moves so little that it shows little of it."
    )
    surge = next(p for p in reported["parameters"] if p["name"] == "surge")
    assert surge["value"] == pytest.approx(40.0, rel=0.02)
