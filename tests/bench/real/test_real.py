"""Diagnoses of real recordings: how they are marked, and that none is confidently wrong."""

from pathlib import Path

import numpy as np
import pytest

from bench.real.__main__ import measured, table_of
from bench.real.dataset import Dataset, datasets
from bench.real.judgement import PARTLY, REFUSED, RIGHT, WRONG, judgement_of
from cspm_sim.effects import catalogue

ROOT = Path(__file__).resolve().parents[4] / "shared" / "data"
ROOTS = (ROOT / "real", ROOT / "open", ROOT)
TRUTH = {"winch_coulomb_friction": {"torque": (0.02, 0.03)}, "winch_torque_offset": {}}
SET = Dataset("a", "b", "c", "d", "e", ["f"], TRUTH, "known", plausible=["winch_load_friction"])


def finding(effect, value=0.025, half=0.002, others=()):
    ends = None if half is None else [value - half, value + half]
    return {
        "effect": effect,
        "parameters": [{"name": "torque", "value": value, "ci95": ends}],
        "alternatives": [{"effect": other} for other in others],
    }


DRY, OFFSET = finding("winch_coulomb_friction"), finding("winch_torque_offset")
FALSE = finding("winch_torque_gain")


@pytest.mark.parametrize(
    ("verdict", "found", "mark"),
    [
        ("effect", [DRY, OFFSET], RIGHT),
        ("effect", [DRY], PARTLY),
        ("effect", [finding("winch_coulomb_friction", 0.04), OFFSET], PARTLY),
        ("effect", [finding("winch_coulomb_friction", 0.04, half=0.015), OFFSET], RIGHT),
        ("effect", [DRY, OFFSET, finding("winch_load_friction")], RIGHT),
        ("tie", [finding("winch_load_friction", others=["winch_coulomb_friction"]), OFFSET], RIGHT),
        ("effect", [DRY, OFFSET, FALSE], WRONG),
        ("tie", [finding("winch_torque_gain", others=["winch_coulomb_friction"]), OFFSET], RIGHT),
        ("unknown", [{"effect": "unknown"}], REFUSED),
        ("unknown", [], REFUSED),
        ("not_excited", [], REFUSED),
        ("consistent", [], WRONG),
    ],
)
def test_the_mark_follows_from_what_is_named(verdict, found, mark):
    assert judgement_of(SET, {"verdict": verdict, "findings": found}).mark == mark


def test_every_effect_of_a_truth_is_in_the_catalogue():
    for each in datasets():
        assert {*each.truth, *each.plausible, *each.without} <= catalogue().keys()


@pytest.mark.slow
@pytest.mark.parametrize("dataset", datasets(), ids=lambda each: each.name)
def test_nothing_is_confidently_wrong(dataset):
    place = dataset.place(ROOTS)
    if place is None:
        pytest.skip(f"no recordings in {dataset.folder}: they have no licence to be shipped")
    row = measured(dataset, place)
    assert row.judgement.mark != WRONG, row.judgement
    assert all(np.isfinite([row.before, row.after, row.true_terms, row.noise]))
    assert dataset.name in table_of([row])
