"""Findings as a table, as lines and as data."""

import io

import pytest
from rich.console import Console

from cspm_ros.check_drivers.driver_observation import Finding, Observation
from cspm_ros.check_drivers.driver_report import (
    by_topic,
    count_line,
    print_findings,
    pulls_data,
    topic_table,
    topics_data,
    verdict_of,
)
from cspm_ros.check_drivers.pull_response import PullVerdict

FINE = Finding("/a", "rate", True, "100.0 Hz")
ODD = Finding("/a", "jitter", None, "in bursts")
WRONG = Finding("/a", "units", False, "looks [in] grams")
ELSEWHERE = Finding("/b", "qos", True, "reliable, from lab")


def shown(print_to):
    console = Console(file=io.StringIO(), width=200)
    print_to(console)
    return [line.split() for line in console.file.getvalue().splitlines() if line.strip()]


@pytest.mark.parametrize(
    ("findings", "verdict"),
    [
        ([], "ok"),
        ([FINE], "ok"),
        ([FINE, ODD], "warning"),
        ([ODD, WRONG, FINE], "error"),
    ],
)
def test_the_worst_finding_is_the_verdict(findings, verdict):
    assert verdict_of(findings) == verdict


def test_findings_are_grouped_in_the_order_asked_for():
    found = by_topic([ELSEWHERE, FINE, ODD], ["/none", "/a"])
    assert found == {"/a": [FINE, ODD], "/b": [ELSEWHERE]}
    assert list(found) == ["/a", "/b"]


def test_the_table_has_a_line_for_each_problem_and_one_for_what_is_fine():
    topics = {"/a": [FINE, ODD, WRONG], "/b": [ELSEWHERE]}
    title, _, _, *rows = shown(lambda console: console.print(topic_table("drivers of x", topics)))
    assert title == ["drivers", "of", "x"]
    assert rows == [
        ["/a", "error", "looks", "[in]", "grams"],
        ["warning", "in", "bursts"],
        ["/b", "ok", "reliable,", "from", "lab"],
    ]


def test_lines_begin_with_the_errors():
    rows = shown(lambda console: print_findings(console, [FINE, ODD, WRONG]))
    assert [row[0] for row in rows] == ["error", "warning", "ok"]
    assert rows[0][1:] == ["looks", "[in]", "grams"]


def test_errors_and_warnings_are_counted():
    assert count_line({"/a": [FINE, ODD, WRONG], "/b": [ODD]}) == "1 error, 2 warnings"
    assert count_line({}) == "0 errors, 0 warnings"


def test_data_hold_what_was_heard():
    heard = Observation("/a", "some/msg/Type", 2, [(1, b""), (2, b"")])
    data = topics_data({"/a": [ODD], "/b": [ELSEWHERE]}, [heard])
    assert data["/a"] == {
        "verdict": "warning",
        "type": "some/msg/Type",
        "publishers": 2,
        "messages": 2,
        "findings": [{"topic": "/a", "check": "jitter", "ok": None, "text": "in bursts"}],
    }
    assert (data["/b"]["type"], data["/b"]["publishers"], data["/b"]["messages"]) == ("", 0, 0)


def test_data_hold_what_a_pull_showed():
    [data] = pulls_data([PullVerdict("c", {"tension": "c"}, (FINE,))])
    assert (data["cable"], data["ok"], data["answered"]) == ("c", True, {"tension": "c"})
    assert data["findings"][0]["text"] == "100.0 Hz"
