"""The table over all sealed parts: counted again from their recordings, and up to date."""

import shutil

import pytest

from bench.blind.scoring.target import allowed
from bench.blind.sealed import (
    ALARMS,
    BOUND,
    DOCS,
    EARLIER,
    LAST,
    PAGE,
    pooled,
    read_part,
    read_parts,
    tables,
    verdict,
)
from bench.page import into_page
from cspm_sim.effects import catalogue

PARTS = read_parts(DOCS)


def listed(part):
    """Rows of "Every recording": stratum, concealed, detection limits, verdict, found."""
    text = (DOCS / part.page).read_text(encoding="utf-8").split("## Every recording\n\n")[1]
    for line in text.splitlines()[2:]:
        _, stratum, concealed, limits, said, found = (c.strip() for c in line[1:-1].split("|"))
        split = (cell.split("<br>") if cell else [] for cell in (concealed, found))
        yield stratum, *split, float(limits), said


def test_the_committed_page_is_what_the_command_writes(tmp_path):
    page = tmp_path / PAGE.name
    shutil.copy(PAGE, page)
    for name, text in tables(PARTS).items():
        into_page(page, name, text)
    assert page.read_text(encoding="utf-8") == PAGE.read_text(encoding="utf-8"), (
        "run: python -m bench.blind.sealed"
    )


def test_there_is_a_page_for_each_part_that_is_told():
    _, reported = PAGE.read_text(encoding="utf-8").split("\n## The sets\n")
    assert len(PARTS) >= 7
    assert all(f"]({part.page})" in reported for part in PARTS)


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.page)
def test_a_parts_counts_are_those_of_its_recordings(part):
    rows = list(listed(part))
    assert len(rows) == len(set(part.recordings)) == len(part.recordings)
    sound = [found for _, hidden, found, _, said in rows if not hidden and said != "failed"]
    assert pooled([part.found[ALARMS]])[:2] == (sum(map(bool, sound)), len(sound))
    known = [
        (hidden, found)
        for _, hidden, found, limits, _ in rows
        if limits >= 2.0 and all(each.split(":")[0] in catalogue() for each in hidden)
    ]
    assert pooled([part.found["anything found"]])[:2] == (
        sum(bool(found) for _, found in known),
        len(known),
    )
    named = sum(set(hidden) <= set(found) for hidden, found in known)
    assert pooled([part.found["all named by some finding"]])[:2] == (named, len(known))


def test_all_parts_together_are_their_sum():
    text = tables(PARTS)["all"]
    recordings = [part.recordings for part in PARTS]
    assert f"{sum(map(len, recordings))} recordings in {len(PARTS)} parts." in text
    named = [pooled([part.found["effect and elements named first"]]) for part in PARTS]
    total = f"({sum(each.hits for each in named)} of {sum(each.cases for each in named)};"
    (row,) = (line for line in text.splitlines() if "named first |" in line)
    assert total in row
    assert f"| {BOUND} |" in text


def test_cells_without_cases_count_nothing():
    assert pooled(["50 % (1 of 2; 1 to 99)", "no cases", "—", "0 % (0 of 3; 0 to 71)"])[:2] == (
        1,
        5,
    )
    assert pooled(["no cases"])[:2] == (0, 0)


@pytest.mark.parametrize(
    ("target", "ends"),
    [
        ("≥ 97 %", (0.97, 1.0)),
        ("≤ 3 %", (0.0, 0.03)),
        ("90 to 97 %", (0.9, 0.97)),
        ("all", (1.0, 1.0)),
        ("≤ 1.5", (0.0, 1.5)),
    ],
)
def test_targets_are_read_as_they_are_told(target, ends):
    assert allowed(target) == pytest.approx(ends)


@pytest.mark.parametrize(
    ("value", "interval", "target", "word"),
    [
        (0.98, (0.975, 0.99), "≥ 97 %", "met"),
        (0.98, (0.95, 0.99), "≥ 97 %", "met, not significantly"),
        (0.96, (0.95, 0.99), "≥ 97 %", "missed, not significantly"),
        (0.90, (0.85, 0.95), "≥ 97 %", "missed"),
        (0.93, (0.91, 0.96), "90 to 97 %", "met"),
        (0.99, (0.98, 1.0), "90 to 97 %", "missed"),
        (0.10, (0.06, 0.17), "≤ 3 %", "missed"),
        (1.0, (0.95, 1.0), "all", "met, not significantly"),
    ],
)
def test_a_target_is_met_surely_only_where_the_whole_interval_meets_it(
    value, interval, target, word
):
    assert verdict(value, interval, target) == word


def test_no_recording_counts_twice(tmp_path):
    (tmp_path / EARLIER).mkdir()
    shutil.copy(DOCS / PARTS[1].page, tmp_path / LAST)
    shutil.copy(DOCS / PARTS[0].page, tmp_path / EARLIER / "part-01.md")
    first, last = read_parts(tmp_path)
    assert (first.page, last.page) == ("sealed/part-01.md", "results.md")
    shutil.copy(DOCS / PARTS[0].page, tmp_path / LAST)
    with pytest.raises(ValueError, match=r"results\.md: 190 recordings are in an earlier part"):
        read_parts(tmp_path)


def test_a_page_of_something_else_is_refused():
    with pytest.raises(ValueError, match="no truth file named"):
        read_part(DOCS / "gallery.md")
