"""How the slice of the blind benchmark is judged; the slice itself is `make validate`."""

import copy

import pytest

pytest.importorskip("mujoco", minversion="4.0", reason="the MuJoCo plant needs MuJoCo 4")
from bench.validation.blind_slice import judged

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
