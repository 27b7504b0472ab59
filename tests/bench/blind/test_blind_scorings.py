"""A sealed benchmark is scored once."""

import json
from datetime import date

import pytest

from bench.blind.commands import score_command
from bench.blind.scorings import enter_scoring, log_of
from bench.blind.truth import SCHEMA
from cspm_msgs_py.errors import InputError

FIRST = {"a": {"diagnosis": {"verdict": "consistent"}, "times": {"cpu_s": 1.0}}}
OTHER = {"a": {"diagnosis": {"verdict": "effect"}, "times": {"cpu_s": 1.0}}}
DAY, NEXT = date(2026, 1, 2), date(2026, 1, 3)


def dates(entry):
    return {name: each["date"] for name, each in entry["recordings"].items()}


def test_results_are_scored_once_and_the_same_ones_again(tmp_path):
    truth = tmp_path / "b.truth.json"
    (entry,) = enter_scoring(truth, "ab", {"cspm": FIRST}, DAY)
    assert (entry["method"], entry["truth_sha256"]) == ("cspm", "ab")
    assert dates(entry) == {"a": "2026-01-02"}
    assert enter_scoring(truth, "ab", {"cspm": FIRST}, NEXT) == [entry]
    with pytest.raises(InputError, match=r"another result of cspm for a was scored 2026-01-02"):
        enter_scoring(truth, "ab", {"cspm": OTHER}, NEXT)
    assert json.loads(log_of(truth).read_text()) == [entry]


def test_recordings_that_were_not_scored_may_be_added_but_none_left_out(tmp_path):
    truth = tmp_path / "b.truth.json"
    enter_scoring(truth, "ab", {"cspm": FIRST}, DAY)
    both = FIRST | {"b": OTHER["a"]}
    (entry,) = enter_scoring(truth, "ab", {"cspm": both}, NEXT)
    assert dates(entry) == {"a": "2026-01-02", "b": "2026-01-03"}
    with pytest.raises(InputError, match=r"another result of cspm for b was scored 2026-01-03"):
        enter_scoring(truth, "ab", {"cspm": FIRST}, NEXT)


def test_a_further_method_is_entered_beside_the_first(tmp_path):
    truth = tmp_path / "b.truth.json"
    enter_scoring(truth, "ab", {"cspm": FIRST}, DAY)
    entries = enter_scoring(truth, "ab", {"cspm": FIRST, "lasso": OTHER}, NEXT)
    assert [(e["method"], dates(e)["a"]) for e in entries] == [
        ("cspm", "2026-01-02"),
        ("lasso", "2026-01-03"),
    ]
    # Nothing of a scoring that is refused is entered.
    with pytest.raises(InputError, match=r"another result of lasso for a"):
        enter_scoring(truth, "ab", {"retuned": FIRST, "lasso": FIRST}, NEXT)
    assert len(json.loads(log_of(truth).read_text())) == 2


def sealed(place, split):
    """A benchmark of one recording with nothing, which was diagnosed."""
    folder, truth = place / split, place / f"{split}.truth.json"
    options = {"seed": 1, "count": 1, "split": split, "duration": 15.0, "strata": ["nothing"]}
    hidden = {"name": "a", "stratum": "nothing", "absorbed_by": None, "concealed": []}
    truth.write_text(json.dumps({"schema": SCHEMA, "asked": options, "items": [hidden]}))
    (folder / "results" / "a").mkdir(parents=True)
    (folder / "results" / "a" / "times.json").write_text('{"wall_s": 1.0, "cpu_s": 1.0}')
    return folder, truth


def diagnosed(folder, verdict):
    report = {"verdict": verdict, "findings": [], "residuals": []}
    (folder / "results" / "a" / "diagnosis.json").write_text(json.dumps(report))


@pytest.mark.parametrize("split", ["dev", "tune"])
def test_other_splits_are_scored_as_often_as_wanted(tmp_path, split):
    folder, truth = sealed(tmp_path, split)
    for verdict in ("consistent", "unknown"):
        diagnosed(folder, verdict)
        score_command(folder, truth, None, None, None)
    assert not log_of(truth).exists()


def test_a_sealed_split_is_not_scored_again_after_another_diagnosis(tmp_path):
    folder, truth = sealed(tmp_path, "sealed")
    diagnosed(folder, "consistent")
    page, card = tmp_path / "page.md", tmp_path / "card.json"
    score_command(folder, truth, None, page, card)
    assert "This is the sealed split" in page.read_text()
    assert "![The scorecard in pictures](page.png)" in page.read_text()
    assert (tmp_path / "page.png").stat().st_size > 10_000
    assert json.loads(card.read_text())["shares"]["false_alarm"][:2] == [0, 1]
    page.unlink()
    diagnosed(folder, "unknown")
    with pytest.raises(
        InputError, match=r"another result of cspm for a was scored .* allowed: each once$"
    ):
        score_command(folder, truth, None, page, card)
    assert not page.exists()
    diagnosed(folder, "consistent")
    score_command(folder, truth, None, page, card)
    assert page.exists()
