"""The table over all sealed parts: counted again from their recordings, and up to date."""

import inspect
import shutil

import pytest

from bench.blind.scoring.figure import draw_scorecard
from bench.blind.scoring.page import scorecard_page
from bench.blind.scoring.target import allowed
from bench.blind.sealed import (
    ALARMS,
    BOUND,
    PAGE,
    pooled,
    read_parts,
    tables,
    verdict,
)
from bench.blind.sealed_card import stored_card
from bench.blind.sealed_store import SECTIONS, STORE, add_page, read_table
from bench.page import into_page
from cspm_sim.effects import catalogue

PARTS = read_parts()
ROWS = read_table(STORE, "recordings")


def listed(part):
    """Rows of the recordings: concealed, found, detection limits, verdict."""
    for row in ROWS:
        if row["part"] == part.number:
            concealed, found = (
                cell.split("<br>") if cell else [] for cell in (row["concealed"], row["found"])
            )
            yield concealed, found, float(row["limits"]), row["verdict"]


def test_the_committed_page_is_what_the_command_writes(tmp_path):
    page = tmp_path / PAGE.name
    shutil.copy(PAGE, page)
    for name, text in tables(PARTS).items():
        into_page(page, name, text)
    assert page.read_text(encoding="utf-8") == PAGE.read_text(encoding="utf-8"), (
        "run: python -m bench.blind.sealed"
    )


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.number)
def test_a_parts_counts_are_those_of_its_recordings(part):
    rows = list(listed(part))
    assert len(rows) == len(set(part.recordings)) == len(part.recordings)
    healthy = [found for hidden, found, _, said in rows if not hidden and said != "failed"]
    assert pooled([part.found[ALARMS]])[:2] == (sum(map(bool, healthy)), len(healthy))
    known = [
        (hidden, found)
        for hidden, found, limits, _ in rows
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
def test_targets_are_read_as_they_are_written(target, ends):
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


SCORECARD = """# Blind results

2 of 2 recordings; truth file SHA-256 `ab12`. Scored 2026-11-25 on 2 processors.

## Against the targets

|  | found | target |
| --- | --- | --- |
| block found | 50 % (1 of 2; 1 to 99) | ≥ 97 % |

## By amount

| detection limits | cases | detected |
| --- | --- | --- |
| 2 | 2 | 50 % (1 of 2; 1 to 99) |

## Every recording

| recording | stratum | concealed | limits | verdict | found |
| --- | --- | --- | --- | --- | --- |
| one | rig |  | 0 | consistent |  |
"""


def scorecard(tmp_path, text=SCORECARD):
    page = tmp_path / "page.md"
    page.write_text(text, encoding="utf-8")
    return page


def test_an_added_page_is_read_back(tmp_path):
    store = tmp_path / "store"
    add_page(scorecard(tmp_path), "1", store)
    (part,) = read_parts(store)
    assert part[:4] == ("1", "ab12", "2026-11-25", ("one",))
    assert part.found == {"block found": "50 % (1 of 2; 1 to 99)"}
    assert part.targets == {"block found": "≥ 97 %"}
    assert part.amounts == {"2": {"detected": "50 % (1 of 2; 1 to 99)"}}


def test_no_recording_counts_twice(tmp_path):
    store, page = tmp_path / "store", scorecard(tmp_path)
    add_page(page, "1", store)
    with pytest.raises(ValueError, match=r"part 1 is already there, allowed: a new number"):
        add_page(page, "1", store)
    with pytest.raises(ValueError, match=r"page\.md: 1 recordings are in an earlier part"):
        add_page(page, "2", store)
    add_page(scorecard(tmp_path, SCORECARD.replace("ab12", "cd34")), "2", store)
    assert [part.number for part in read_parts(store)] == ["1", "2"]


def test_a_page_of_something_else_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no truth file named"):
        add_page(scorecard(tmp_path, "# Gallery\n"), "1", tmp_path / "store")


def test_a_stored_part_is_the_scorecard_of_its_picture(tmp_path):
    card = stored_card("18")
    assert card["shares"]["first"][:2] == (203, 242)
    assert (
        card["parameters"]["covered"][:2]
        == pooled(
            [each.found["intervals that hold the truth"] for each in PARTS if each.number == "18"]
        )[:2]
    )
    assert [row["multiple"] for row in card["by_multiple"]] == [0.5, 1.0, 2.0, 4.0, 8.0]
    assert [row["said"] for row in card["calibration"]] == [0.3, 0.62, 0.9]
    assert {row["scored"] for row in card["peers"]} == {36}
    assert card["peers"][1]["false_alarm"][:2] == (2, 2)
    draw_scorecard(tmp_path / "card.png", card)
    assert (tmp_path / "card.png").stat().st_size > 10_000
    with pytest.raises(ValueError, match="--draw 99: allowed: a part of"):
        stored_card("99")


def test_sections_of_the_store_are_those_of_a_scorecards_page():
    page = inspect.getsource(scorecard_page) + "## Peers ## Without one safeguard"
    assert [title for title in SECTIONS if f"## {title}" not in page] == []
