"""A few recordings of the blind benchmark's slice; the whole of it is `make validate`.

One of each kind that `test_blind_seal` lacks: a wrong parameter, two causes at once, a cause that
the catalogue lacks, a healthy rig.
"""

import copy

import pytest

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.validation.blind_slice import CASES, card_of, judged

CHOSEN = {
    "parameter": CASES["parameter"][:1],
    "company": CASES["company"],
    "outside": CASES["outside"][:1],
    "rig": CASES["rig"][:1],
}


@pytest.fixture(scope="module")
def card(tmp_path_factory):
    return card_of(CHOSEN, tmp_path_factory.mktemp("slice"))


@pytest.mark.slow
def test_each_is_diagnosed_as_what_it_is(card):
    shares = card["shares"]
    assert card["scored"] == 4
    assert shares["failed"][0] == 0
    # The healthy rig, and the mass that is a parameter.
    assert shares["false_alarm"][:2] == (0, 1)
    assert shares["parameter_called_effect"][:2] == (0, 1)
    assert shares["unknown_recognised"][:2] == (1, 1)


@pytest.mark.slow
def test_what_is_clear_is_found_where_it_is_and_named(card):
    shares = card["shares"]
    assert shares["detected"][:2] == shares["element"][:2] == shares["first"][:2] == (2, 2)
    assert shares["mean_tie_size"] <= 2.0
    right, numbers = card["parameters"]["within_a_tenth"][:2]
    assert right >= 0.7 * numbers > 0.0


GOOD = {
    "scored": 17,
    "shares": {
        "failed": (0, 17),
        "false_alarm": (0, 3),
        "parameter_called_effect": (0, 2),
        "detected": (13, 13),
        "element": (12, 13),
        "tied": (12, 13),
        "first": (11, 13),
        "mean_tie_size": 1.5,
        "unknown_recognised": (2, 2),
        "false_unknown": (2, 13),
    },
    "parameters": {"within_a_tenth": (7, 10)},
    "fit": {"near_floor": (8, 10)},
}


def test_bounds_hold_at_their_ends_and_not_beyond():
    assert all(finding.holds for finding in judged(GOOD))
    worse = {
        ("shares", "failed"): (1, 17),
        ("shares", "false_alarm"): (1, 3),
        ("shares", "parameter_called_effect"): (1, 2),
        ("shares", "detected"): (12, 13),
        ("shares", "element"): (11, 13),
        ("shares", "tied"): (11, 13),
        ("shares", "first"): (10, 13),
        ("shares", "mean_tie_size"): 2.1,
        ("shares", "unknown_recognised"): (1, 2),
        ("shares", "false_unknown"): (3, 13),
        ("parameters", "within_a_tenth"): (6, 10),
        ("fit", "near_floor"): (7, 10),
    }
    assert len(worse) == len(judged(GOOD))
    for (part, name), value in worse.items():
        card = copy.deepcopy(GOOD)
        card[part][name] = value
        assert sum(not finding.holds for finding in judged(card)) == 1, name
