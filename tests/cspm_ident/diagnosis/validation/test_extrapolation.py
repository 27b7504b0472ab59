"""Held-out data beyond the searched range of a signal."""

import numpy as np
import pytest

from cspm_ident.diagnosis.reporting.statement import extrapolation_statement
from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.validation.extrapolation import extrapolations
from cspm_sim.effects import Channel

SHAFT, OTHER = (Place(Channel.SHAFT, name) for name in ("a", "b"))


def turning(most, place=SHAFT):
    """A shaft that turns up to a speed both ways, each speed as often, for ten seconds."""
    times = np.linspace(0.0, 10.0, 1001)
    target = np.zeros((len(times), 1))
    signals = {"speed [rad/s]": np.linspace(-most, most, len(times)), "time [s]": times + most}
    return [Equation(place, times, target, {}, target, signals=signals)]


@pytest.mark.parametrize(("reach", "share"), [(0.9, None), (1.04, None), (2.0, 0.5)])
def test_what_held_out_data_reach_beyond_is_said(reach, share):
    """From a share of the rows on; functions of time are never extrapolated."""
    found = extrapolations([turning(1.0)], [turning(reach)], {SHAFT}, 0.05)
    assert [(e.place, e.signal) for e in found] == [(SHAFT, "speed [rad/s]")] * (share is not None)
    for each in found:
        assert each.share == pytest.approx(share, abs=2e-3)
        assert (each.searched, each.held_out) == ((-1.0, 1.0), (-reach, reach))
        assert extrapolation_statement(each) == (
            "Held-out data of winches/torque/a take the speed from -2 to 2 rad/s, where -1 to 1"
            " rad/s was searched: for 50 % of their rows the findings are extrapolated."
        )


def test_residuals_without_findings_do_not_count():
    assert extrapolations([turning(1.0, OTHER)], [turning(2.0, OTHER)], {SHAFT}, 0.05) == ()
    assert extrapolations([turning(1.0, OTHER)], [turning(2.0)], {SHAFT}, 0.05) == ()
