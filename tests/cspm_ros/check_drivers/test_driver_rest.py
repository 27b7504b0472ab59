"""A machine at rest is judged by its statics, though drivers repeat the same numbers."""

from dataclasses import replace

import numpy as np
import pytest
from driver_samples import BAR, FRAME, TENSION, WINCHES, lab_of, said, wrong

from cspm_ros.check_drivers.driver_rest import AT_REST


def still(feed):
    """The same numbers in every message."""
    return replace(feed, rows=np.repeat(feed.rows[:1], len(feed.rows), axis=0))


def stopped(feed):
    """Speeds of zero, as a drive's counter reports them at rest."""
    rows = feed.rows.copy()
    rows[:, 8:16] = 0.0
    return replace(feed, rows=rows)


def with_z_up(feed):
    rows = feed.rows.copy()
    rows[:, 2] *= -1.0
    return replace(feed, rows=rows)


def winding(feed):
    """The first winch takes in 10 rad during the window."""
    rows = feed.rows.copy()
    rows[:, 0] += np.linspace(0.0, 10.0, len(rows))
    return replace(feed, rows=rows)


@pytest.fixture(scope="module")
def rest(tmp_path_factory):
    lab = lab_of(tmp_path_factory.mktemp("rest") / "r", "rest", "duration=1.0")
    for name in (BAR, FRAME, TENSION, WINCHES):
        lab = lab.but(name, still)
    return lab.but(WINCHES, stopped)


def test_statics_of_a_motionless_machine_are_judged(rest):
    findings = rest.findings()
    assert wrong(findings) == set()
    assert said(findings, BAR, "changes") == [(None, AT_REST)]
    assert said(findings, BAR, "axes") == [
        (True, "z points down: the bar is 2.25 m below the exits")
    ]
    assert [ok for ok, _ in said(findings, TENSION, "balance")] == [True]
    assert {ok for ok, _ in said(findings, WINCHES, "holding")} == {True}


def test_z_that_points_up_is_found_without_motion(rest):
    [(ok, text)] = said(rest.but(BAR, with_z_up).findings(), BAR, "axes")
    assert ok is False
    assert text.endswith("above the exits: z points up, expected: down")


@pytest.mark.parametrize("factor", [1e3 / 9.80665, 0.5])
def test_tensions_that_do_not_carry_the_weight_are_found_without_motion(rest, factor):
    findings = rest.but(TENSION, lambda feed: feed.scaled(factor)).findings()
    found = said(findings, TENSION, "units") + said(findings, TENSION, "balance")
    assert False in {ok for ok, _ in found}


def heaving(feed):
    """The frame rises by 10 cm during the window."""
    rows = feed.rows.copy()
    rows[:, 2] -= np.linspace(0.0, 0.1, len(rows))
    return replace(feed, rows=rows)


@pytest.mark.parametrize(("name", "motion"), [(FRAME, heaving), (WINCHES, winding)])
def test_constant_poses_beside_a_machine_that_moves_judge_nothing(rest, name, motion):
    findings = rest.but(name, motion).findings()
    assert said(findings, BAR, "changes") == [(None, "does not change: is the sensor on?")]
    assert said(findings, BAR, "axes") == [(None, f"cannot decide without a usable {BAR}")]
