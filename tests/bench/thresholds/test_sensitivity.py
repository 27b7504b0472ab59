"""Thresholds moved one at a time, what that changes, and the page that says so."""

import json
from collections import Counter
from dataclasses import fields, replace

import pytest

from bench.thresholds import sensitivity
from bench.thresholds.development_set import SET
from bench.thresholds.move import Move, moves, watched
from bench.thresholds.sensitivity import BASE, REPORTING, Task, change, kept, outcomes
from bench.thresholds.sensitivity_page import sensitivity_page
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS, Thresholds

FINDING = {"effect": "a", "elements": ["one"], "alternatives": [], "value": 1.0}
DATA = {"verdict": "effect", "findings": [FINDING]}


def test_every_threshold_moves_down_and_up_within_its_range():
    known = {each.name: each for each in fields(Thresholds)}
    found = list(moves())
    assert {move.name for move in found} == set(known)
    assert max(Counter(move.name for move in found).values()) == 2
    for move in found:
        assert known[move.name].metadata["low"] <= move.value <= known[move.name].metadata["high"]
        assert getattr(move.thresholds, move.name) == move.value != known[move.name].default
    assert Move("tie_sigma", 3.0) in found
    assert Move("whole_share", 1.0) in found
    assert Move("most_effects", 2) in found
    assert Move("most_effects", 4) in found


def test_thresholds_remember_what_was_read():
    thresholds, read = watched()
    assert read == set()
    assert thresholds.tie_sigma == DEFAULT_THRESHOLDS.tie_sigma
    assert read == {"tie_sigma"}
    assert isinstance(thresholds, Thresholds)


@pytest.mark.parametrize(
    ("after", "words"),
    [
        (DATA, "nothing"),
        ({**DATA, "verdict": "tie"}, "verdict: tie"),
        ({**DATA, "findings": []}, "findings: − a on one"),
        ({**DATA, "findings": [{**FINDING, "effect": "b"}]}, "findings: − a on one, + b on one"),
        ({**DATA, "findings": [FINDING, FINDING]}, "findings: another number of them"),
        (
            {**DATA, "findings": [{**FINDING, "alternatives": [{**FINDING, "effect": "c"}]}]},
            "alternatives",
        ),
        ({**DATA, "findings": [{**FINDING, "value": 2.0}]}, "numbers"),
    ],
)
def test_the_most_important_change_is_named(after, words):
    assert change(DATA, after) == words


def found(case, **moved):
    """What a recording's diagnoses gave; `tie_sigma` alone is read."""
    report = {f"{move.name}={move.value:.6g}": DATA for move in moves() if move.name in REPORTING}
    own = {f"{case}/{BASE}.json": {"data": DATA, "read": ["tie_sigma"], "report": report}}
    for value in (1, 3):
        own[f"{case}/tie_sigma={value}.json"] = moved.get(f"to_{value}", {"data": DATA})
    return own


def test_a_threshold_that_is_not_read_needs_no_diagnosis():
    own = dict(outcomes(found("friction", to_3={"refused": "why"}), "friction"))
    assert own[Move("tie_sigma", 1.0)] == "nothing"
    assert own[Move("tie_sigma", 3.0)] == "refused"
    assert own[Move("certain_sigma", 1.5)] == "not read"
    assert own[Move("trusted_probability", 0.45)] == "nothing"


def test_what_is_kept_is_not_diagnosed_again(tmp_path, monkeypatch):
    calls = []

    def diagnosed(task, recordings):
        calls.append(task)
        return {"data": DATA}

    monkeypatch.setattr(sensitivity, "diagnosed", diagnosed)
    task = Task("friction", Move("tie_sigma", 3.0))
    first = kept(task, str(tmp_path), "code")
    assert kept(task, str(tmp_path), "code") == first == {"data": DATA}
    assert len(calls) == 1
    kept(task, str(tmp_path), "other code")
    assert len(calls) == 2
    (place,) = (tmp_path / "code").glob("friction-*/*")
    assert json.loads(place.read_text()) == first


def test_the_page_lists_what_changes_nothing_and_what_is_not_read():
    one = next(case for case in SET if case.name == "friction")
    worse = {"data": {**DATA, "verdict": "unknown"}}
    same = {"friction": dict(outcomes(found("friction"), "friction"))}
    page = sensitivity_page([one], same)
    silent, _, unread = page.partition("Not read on this set: ")
    assert "`tie_sigma`" in silent
    assert "`certain_sigma`" in unread.splitlines()[0]
    other = sensitivity_page(
        [one], {"friction": dict(outcomes(found("friction", to_3=worse), "friction"))}
    )
    assert "| `tie_sigma` | 2 | 3 | verdict: unknown |" in other
    assert "| `tie_sigma` | 2 | 1 |" not in other
    assert "| `tie_sigma`" not in page
    assert "`tie_sigma`" not in other.partition("Not read on this set: ")[0]


def test_the_set_has_fixed_seeds_and_names_of_its_own():
    assert len({case.name for case in SET}) == len({case.seed for case in SET}) == len(SET)
    assert all(case.duration <= 15.0 for case in SET)
    assert replace(SET[0], seed=1).key != SET[0].key
    assert SET[0].key.startswith(f"{SET[0].name}-")
