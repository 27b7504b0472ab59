"""The measurement of alarms on healthy machines."""

import json

from bench.accuracy.healthy_machines import DURATIONS, Case, alarms, cases, table_of, verdict


def test_a_hundred_recordings_of_6_to_60_s_share_no_seed():
    drawn = cases()
    assert (min(DURATIONS), max(DURATIONS)) == (6.0, 60.0)
    assert len({each.seed for each in drawn}) == len({each.name for each in drawn}) == 100


def test_a_verdict_is_found_once(tmp_path):
    case = Case("one_winch", 3, 6.0)
    found = verdict(case, tmp_path)
    assert found["verdict"] in ("consistent", "not_excited")
    stored = tmp_path / "one_winch_6s.json"
    assert json.loads(stored.read_text()) == found
    stored.write_text('{"verdict": "unknown", "sentence": "kept"}')
    assert verdict(case, tmp_path)["sentence"] == "kept"


def test_an_alarm_is_what_says_that_something_is_missing():
    said = ("consistent", "not_excited", "refused", "unknown", "effect")
    found = {Case("calm", k, 6.0): {"verdict": each} for k, each in enumerate(said)}
    assert [case.seed for case in alarms(found)] == [3, 4]
    assert [column.header for column in table_of(found).columns] == ["scenario", *sorted(said)]
