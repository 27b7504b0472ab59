"""All sealed recordings in one table: `python -m bench.blind.sealed` renews docs/blind/sealed.md.

It counts what the pages of the parts say, each written when its part was scored, once: those of
docs/blind/sealed, and docs/blind/results.md, of the last set of which all recordings were scored.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from bench.blind.scoring.share import Share, share_of, share_words, upper_bound
from bench.blind.scoring.target import Range, allowed
from bench.markdown import markdown_table
from bench.page import into_page

DOCS = Path(__file__).resolve().parents[2] / "docs" / "blind"
PAGE, EARLIER, LAST = DOCS / "sealed.md", "sealed", "results.md"
ALARMS, BOUND = "alarm where there is nothing", "one-sided upper bound of alarms"
TIED, TIES = "truth among the ties", "mean size of the ties"
_COUNTS = re.compile(r"\((\d+) of (\d+);")
_TRUTH = re.compile(r"truth file SHA-256 `(\w+)`\. Scored (\S+) ")


class Part(NamedTuple):
    """What the page of one part says.

    Attributes:
        page: its file, from `docs/blind`.
        truth: SHA-256 of its set's truth file.
        date: when it was scored.
        recordings: their names.
        found: cells of the table against the targets, by row.
        targets: of the same rows; empty where there is none.
        amounts: cells by detection limits and column.
    """

    page: str
    truth: str
    date: str
    recordings: tuple[str, ...]
    found: Mapping[str, str]
    targets: Mapping[str, str]
    amounts: Mapping[str, Mapping[str, str]]


def main() -> None:
    """Read the parts' pages and renew the page of all."""
    for name, text in tables(read_parts(DOCS)).items():
        into_page(PAGE, name, text)


def read_parts(folder: Path) -> list[Part]:
    """Return the parts, those of docs/blind/sealed in the order in which they were scored.

    Args:
        folder: that of the page of all parts.

    Raises:
        ValueError: a recording is in two parts.
    """
    pages = [*sorted((folder / EARLIER).glob("part-*.md")), folder / LAST]
    parts = [read_part(page, folder) for page in pages]
    seen: set[tuple[str, str]] = set()
    for part in parts:
        own = {(part.truth, name) for name in part.recordings}
        if seen & own:
            raise ValueError(f"{part.page}: {len(seen & own)} recordings are in an earlier part")
        seen |= own
    return parts


def read_part(page: Path, folder: Path = DOCS) -> Part:
    """Read a page that `python -m bench.blind score --page` has written.

    Args:
        page: somewhere in the folder.
        folder: from which it is linked.

    Raises:
        ValueError: it does not say of which truth it is.
    """
    text = page.read_text(encoding="utf-8")
    reported = _TRUTH.search(text)
    if reported is None:
        raise ValueError(
            f"{page}: no truth file named, allowed: a page of `python -m bench.blind score`"
        )
    sections = dict(each.split("\n", 1) for each in text.split("\n## ")[1:])
    heads, *amounts = _table(sections["By amount"])
    _, *targets = _table(sections["Against the targets"])
    _, *recordings = _table(sections["Every recording"])
    return Part(
        str(page.relative_to(folder)),
        reported.group(1),
        reported.group(2),
        recordings=tuple(row[0] for row in recordings),
        found={label: found for label, found, _ in targets},
        targets={label: target for label, _, target in targets},
        amounts={row[0]: dict(zip(heads[2:], row[2:], strict=True)) for row in amounts},
    )


def _table(text: str) -> Iterator[list[str]]:
    """Yield the cells of each row but the rule of a section's table."""
    for line in text.splitlines():
        if line.startswith("|") and not line.startswith("| ---"):
            yield [cell.strip() for cell in line.strip("|").split("|")]


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
    names = [str(k) for k in range(1, len(parts) + 1)]
    rows = [(label, *_judged(parts, label, targets[label])) for label in labels]
    return {
        "all": "\n\n".join(
            (_summary(parts, rows), markdown_table(("", "found", "target", ""), rows))
        ),
        "amounts": markdown_table(*_amounts(parts)),
        "sets": markdown_table(
            ("part", "set", "scored", "recordings"),
            [
                (f"[{k}]({p.page})", f"`{p.truth[:8]}`", p.date, str(len(p.recordings)))
                for k, p in zip(names, parts, strict=True)
            ],
        ),
        "parts": markdown_table(
            ("", *names),
            [(label, *(part.found.get(label, "—") for part in parts)) for label in labels],
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
