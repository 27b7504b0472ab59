"""Estimates that are no result, beside those that are."""

import numpy as np
import pytest

from cspm_ident.estimation.estimate import Estimate
from cspm_ident.estimation.objection import error_objections, sign_objections


def estimate(**ends):
    """An estimate of inertia and friction with these intervals."""
    given = {"inertia": (0.9, 1.1), "friction": (0.1, 0.3), **ends}
    names = tuple(given)
    ci95 = np.array([given[name] for name in names])
    values = np.where(np.isfinite(ci95[:, 0]), 0.5, 0.0)
    table = np.eye(len(names))
    return Estimate(
        names, ("u",) * len(names), values, values, ci95, table, (), (), (), 9.0, 9.0, "least"
    )


def objections(**ends):
    return sign_objections(estimate(**ends), {"inertia"}, {"friction"}, "check the signs")


def test_a_machine_as_it_can_be_has_no_objection():
    assert objections() == []
    assert objections(friction=(-0.1, 0.3)) == []
    assert objections(offset=(-3.0, -2.0)) == []
    assert objections(inertia=(-np.inf, np.inf)) == []


def test_an_inertia_that_may_be_none_is_not_determined():
    (found,) = objections(inertia=(-0.1, 0.3))
    assert found.parameters == ("inertia",)
    assert found.text == (
        "no result: inertia -0.1 … 0.3 u holds 0, so that it is not determined;"
        " excite it more, or record longer"
    )


def test_an_inertia_below_zero_spoils_all():
    (found,) = objections(inertia=(-1.1, -0.9), friction=(-0.3, -0.1))
    assert found.parameters == ("inertia", "friction")
    assert found.text == (
        "no result: inertia -1.1 … -0.9 u is below 0, which no machine has; check the signs"
    )


def test_an_inertia_below_zero_beside_a_friction_above_it_is_its_own():
    (found,) = objections(inertia=(-1.1, -0.9))
    assert found.parameters == ("inertia",)


def test_a_friction_below_zero_is_its_own():
    (found,) = objections(friction=(-0.3, -0.1))
    assert found.parameters == ("friction",)
    assert found.data()["remedy"] == "check the signs"


@pytest.mark.parametrize("percent", [100.0, 291.2, float("nan")])
def test_an_error_as_large_as_the_signal_is_none(percent):
    (found,) = error_objections(estimate(), [("monday", 3.0), ("tuesday", percent)], "torque")
    assert found.parameters == ("inertia", "friction")
    assert found.reason == f"the error in tuesday is {percent:.0f} % of the torque itself"


def test_an_error_below_the_signal_is_one():
    assert error_objections(estimate(), [("monday", 99.0)], "torque") == []
