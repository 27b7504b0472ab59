"""A sealed benchmark is scored once."""

import json
from datetime import date

import pytest

from cspm_bringup.blind.scorings import enter_scoring, log_of
from cspm_msgs_py.errors import InputError

FIRST = {"a": {"diagnosis": {"verdict": "consistent"}, "times": {"cpu_s": 1.0}}}
OTHER = {"a": {"diagnosis": {"verdict": "effect"}, "times": {"cpu_s": 1.0}}}
DAY, NEXT = date(2026, 1, 2), date(2026, 1, 3)


def test_results_are_scored_once_and_the_same_ones_again(tmp_path):
    truth = tmp_path / "b.truth.json"
    (entry,) = enter_scoring(truth, "ab", {"cspm": FIRST}, DAY)
    assert (entry["date"], entry["method"], entry["truth_sha256"]) == ("2026-01-02", "cspm", "ab")
    assert enter_scoring(truth, "ab", {"cspm": FIRST}, NEXT) == [entry]
    with pytest.raises(InputError, match=r"other results of cspm were scored 2026-01-02"):
        enter_scoring(truth, "ab", {"cspm": OTHER}, NEXT)
    assert json.loads(log_of(truth).read_text()) == [entry]


def test_a_further_method_is_entered_beside_the_first(tmp_path):
    truth = tmp_path / "b.truth.json"
    enter_scoring(truth, "ab", {"cspm": FIRST}, DAY)
    entries = enter_scoring(truth, "ab", {"cspm": FIRST, "lasso": OTHER}, NEXT)
    assert [(e["method"], e["date"]) for e in entries] == [
        ("cspm", "2026-01-02"),
        ("lasso", "2026-01-03"),
    ]
    # Nothing of a scoring that is refused is entered.
    with pytest.raises(InputError, match=r"other results of lasso"):
        enter_scoring(truth, "ab", {"retuned": FIRST, "lasso": FIRST}, NEXT)
    assert len(json.loads(log_of(truth).read_text())) == 2
