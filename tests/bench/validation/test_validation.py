"""Checks with bounds: what holds, what does not, and the page that says so."""

import numpy as np
import pytest

from bench.accuracy.coverage import DEFAULT, PLAIN, Count
from bench.validation import __main__ as command
from bench.validation.check import Check, Finding, at_least, at_most
from bench.validation.coverage_check import judged, measure
from bench.validation.generated_pages import angles_of, apart, numbers_in, same_angles


@pytest.mark.parametrize(("found", "least", "most"), [(6, False, True), (7, True, True)])
def test_a_bound_holds_at_its_end(found, least, most):
    assert at_least("a", found, 7, 10) == Finding("a", f"{found} of 10", "≥ 7", least)
    assert at_most("a", found, 7, 10) == Finding("a", f"{found} of 10", "≤ 7", most)
    assert not at_most("a", 8, 7, 10).holds


def test_intervals_have_to_hold_and_those_of_plain_least_squares_must_not():
    """With 200 runs at a coverage of 90 % or more, 166 or more contain the truth, nearly always."""
    found = judged([Count(DEFAULT, "a", inside, 200) for inside in (165, 166, 190)])
    assert [each.holds for each in found] == [False, True, True]
    found = judged([Count(PLAIN, "a", inside, 200) for inside in (70, 165, 166)])
    assert [each.holds for each in found] == [True, True, False]


class Short:
    """Intervals that contain the truth half of the time."""

    names = ("side",)
    truth = np.array([0.5])

    def intervals(self, rng):
        yield DEFAULT, np.array([[rng.uniform(0.0, 1.0), np.inf]])


def test_intervals_that_are_too_short_do_not_hold():
    (found,) = measure(Short(), runs=50)
    assert not found.holds
    assert found.quantity == f"{DEFAULT}: side"


PAGE = "# Angles\n| `a`, `b` | 10 | — |\n| `a`, `c` | 80.0 | 3 |\n"


@pytest.mark.parametrize(
    ("one", "other", "differ"),
    [("10", "11", False), ("10", "11.1", True), ("—", "—", False), ("—", "0", True)],
)
def test_angles_may_differ_by_a_degree(one, other, differ):
    assert apart(one, other) is apart(other, one) is differ


@pytest.mark.parametrize(
    ("fresh", "found"),
    [
        (PAGE, "0 of 2"),
        (PAGE.replace("80.0", "80.9"), "0 of 2"),
        (PAGE.replace("80.0", "70"), "1 of 2"),
        (PAGE.replace("`c`", "`d`"), "2 of 3"),
        (PAGE.replace("| 10 |", "| — |"), "1 of 2"),
    ],
)
def test_pairs_that_differ_are_counted(fresh, found):
    assert angles_of(PAGE)["a", "b"] == ["10", "—"]
    finding = same_angles(PAGE, fresh)
    assert (finding.found, finding.holds) == (found, found.startswith("0"))


def test_marked_blocks_are_found_by_name():
    text = "a\n<!-- numbers: one -->\n1\n<!-- end -->\n<!-- numbers: two -->\n2\n<!-- end -->\n"
    assert list(numbers_in(text)) == ["one", "two"]
    assert "\n1\n" in numbers_in(text)["one"]


@pytest.mark.parametrize(
    ("holds", "code", "mark"), [(True, 0, "| yes |"), (False, 1, "| **no** |")]
)
def test_the_command_writes_its_page_and_fails_where_a_bound_does_not_hold(
    monkeypatch, tmp_path, capsys, holds, code, mark
):
    page = tmp_path / "page.md"
    check = Check("Counts", "Two counts", lambda: [Finding("a", "1 of 2", "≥ 1", holds)])
    monkeypatch.setattr(command, "PAGE", page)
    monkeypatch.setattr(command, "CHECKS", (check,))
    monkeypatch.setattr("sys.argv", ["validation"])
    assert command.main() == code
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# Validation runs\n")
    assert "\n## Counts\n\nTwo counts. 0.0 minutes.\n" in text
    assert f"| a | 1 of 2 | ≥ 1 {mark}" in text
    assert "a: 1 of 2, allowed ≥ 1" in capsys.readouterr().out


def test_a_part_of_the_checks_leaves_the_page_alone(monkeypatch, tmp_path):
    monkeypatch.setattr(command, "PAGE", tmp_path / "page.md")
    monkeypatch.setattr("sys.argv", ["validation", "no such check"])
    assert command.main() == 0
    assert not (tmp_path / "page.md").exists()
