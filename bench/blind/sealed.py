"""All sealed parts in one page: `python -m bench.blind.sealed` renews results/sealed/README.md.

It counts what the CSV files of results/sealed say. They are filled from the page that was written
when a part was scored, once: `python -m bench.blind.sealed --add PAGE`.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from bench.blind.scoring.brier import brier_of
from bench.blind.scoring.share import Share, share_of, share_words, upper_bound
from bench.blind.scoring.target import Range, allowed
from bench.blind.sealed_card import stored_card
from bench.blind.sealed_store import STORE, add_page, read_table
from bench.markdown import markdown_table
from bench.page import into_page

PAGE = STORE / "README.md"
ALARMS, BOUND = "alarm where there is nothing", "one-sided upper bound of alarms"
TIED, TIES = "truth among the ties", "mean size of the ties"
_COUNTS = re.compile(r"\((\d+) of (\d+);")


class Part(NamedTuple):
    """What one part of a sealed set was scored at.

    Attributes:
        number: its place in the order of scoring, from 1.
        truth: SHA-256 of its set's truth file.
        date: when it was scored.
        recordings: their names.
        found: cells of the table against the targets, by row.
        targets: of the same rows; empty where there is none.
        amounts: cells by detection limits and column.
        probabilities: by bin, the mean reported and the share that was right.
    """

    number: str
    truth: str
    date: str
    recordings: tuple[str, ...]
    found: Mapping[str, str]
    targets: Mapping[str, str]
    amounts: Mapping[str, Mapping[str, str]]
    probabilities: Sequence[tuple[float, Share]] = ()


def main() -> None:
    """Add a page of one part if asked to, and renew the page of all."""
    parser = argparse.ArgumentParser(description="Count all sealed parts together.")
    parser.add_argument("--add", type=Path, metavar="PAGE", help="scorecard page of a new part")
    parser.add_argument("--draw", metavar="PART", help="draw the scorecard of a part again")
    options = parser.parse_args()
    if options.add is not None:
        add_page(options.add, str(len(read_table(STORE, "parts")) + 1))
    if options.draw is not None:
        from bench.blind.scoring.figure import draw_scorecard

        draw_scorecard(STORE / f"part-{options.draw}.png", stored_card(options.draw))
    for name, text in tables(read_parts()).items():
        into_page(PAGE, name, text)


def read_parts(folder: Path = STORE) -> list[Part]:
    """Return the parts in the order in which they were scored.

    Args:
        folder: that of the CSV files.
    """
    names = ("recordings", "targets", "amounts", "probabilities")
    stored = {name: read_table(folder, name) for name in names}
    return [_part(each, stored) for each in read_table(folder, "parts")]


def _part(part: Mapping[str, str], stored: Mapping[str, list[dict[str, str]]]) -> Part:
    """Return one part from the rows of all."""
    own = {
        name: [each for each in rows if each["part"] == part["part"]]
        for name, rows in stored.items()
    }
    known = ("part", "detection limits", "cases")
    return Part(
        part["part"],
        part["truth"],
        part["scored"],
        recordings=tuple(row["recording"] for row in own["recordings"]),
        found={row["measure"]: row["found"] for row in own["targets"]},
        targets={row["measure"]: row["target"] for row in own["targets"]},
        amounts={
            row["detection limits"]: {head: cell for head, cell in row.items() if head not in known}
            for row in own["amounts"]
        },
        probabilities=[
            (float(row["mean"]), pooled([row["effect right"]]))
            for row in own["probabilities"]
            if _COUNTS.search(row["effect right"])
        ],
    )


def pooled(cells: Sequence[str]) -> Share:
    """Return the share of all cases of some cells, which may say that there are none."""
    counts = [found.groups() for cell in cells if (found := _COUNTS.search(cell))]
    hits, cases = (sum(int(each[k]) for each in counts) for k in (0, 1))
    return share_of(hits, cases)


def verdict(value: float, interval: Range, target: str) -> str:
    """Return whether a target is met, and whether the interval leaves that open."""
    (low, high), (least, most) = interval, allowed(target)
    word = "met" if least <= value <= most else "missed"
    sure = (least <= low and high <= most) if word == "met" else (high < least or most < low)
    return word if sure else f"{word}, not significantly"


def tables(parts: Sequence[Part]) -> dict[str, str]:
    """Return the page's tables by the names of their marks."""
    labels = list(dict.fromkeys(label for part in parts for label in part.found))
    targets = {label: target for part in parts for label, target in part.targets.items()}
    rows = [(label, *_judged(parts, label, targets[label])) for label in labels]
    return {
        "all": "\n\n".join(
            (_summary(parts, rows), markdown_table(("", "found", "target", ""), rows))
        ),
        "amounts": markdown_table(*_amounts(parts)),
        "probabilities": _probabilities(parts),
        "sets": markdown_table(
            ("part", "set", "scored", "recordings"),
            [
                (part.number, f"`{part.truth[:8]}`", part.date, str(len(part.recordings)))
                for part in parts
            ],
        ),
    }


def _judged(parts: Sequence[Part], label: str, target: str) -> tuple[str, str, str]:
    """Return what was found over all parts, its target, and whether that is met."""
    found = pooled([part.found.get(label, "") for part in parts])
    value, interval = found.hits / max(1, found.cases), (found.low, found.high)
    words = share_words(found)
    if label == BOUND:
        alarms = pooled([part.found[ALARMS] for part in parts])
        value = upper_bound(alarms.hits, alarms.cases)
        words = f"{100 * value:.1f} %"
    elif label == TIES:
        value = _mean_ties(parts)
        words = f"{value:.2f}"
    if label in (BOUND, TIES):
        interval = value, value
    return words, target, verdict(value, interval, target) if target else ""


def _mean_ties(parts: Sequence[Part]) -> float:
    """Return the mean over parts by how many recordings have a set of ties that holds a truth."""
    weights = [pooled([part.found[TIED]]).hits for part in parts]
    sizes = [float(part.found[TIES]) for part in parts]
    return sum(w * s for w, s in zip(weights, sizes, strict=True)) / sum(weights)


def _summary(parts: Sequence[Part], rows: Sequence[tuple[str, ...]]) -> str:
    count = sum(len(part.recordings) for part in parts)
    judged = {word: [row[0] for row in rows if row[3] == word] for word in _VERDICTS}
    reported = (f"{word.capitalize()}: {', '.join(own)}." for word, own in judged.items() if own)
    return f"{count} recordings in {len(parts)} parts. {' '.join(reported)}"


def _probabilities(parts: Sequence[Part]) -> str:
    """Return the Brier score of each part that has reported a probability."""
    found = [(part.number, brier_of(part.probabilities)) for part in parts]
    return markdown_table(
        ("part", "findings", "Brier score", "of the share of all that are right"),
        [
            (number, str(own.findings), f"{own.score:.3f}", f"{own.constant:.3f}")
            for number, own in found
            if own is not None
        ],
    )


def _amounts(parts: Sequence[Part]) -> tuple[list[str], list[list[str]]]:
    """Return heads and rows of all parts by amount."""
    columns = list(parts[0].amounts["2"])
    rows = []
    for limits in sorted({each for part in parts for each in part.amounts}, key=float):
        cells = [part.amounts[limits] for part in parts if limits in part.amounts]
        shares = [pooled([cell[column] for cell in cells]) for column in columns]
        rows.append([limits, str(shares[0].cases), *(share_words(each) for each in shares)])
    return ["detection limits", "cases", *columns], rows


_VERDICTS = ("met", "met, not significantly", "missed, not significantly", "missed")


if __name__ == "__main__":
    main()
