"""Could a blind benchmark's misses be found at all? `python -m bench.blind.misses DIR TRUTH`.

DIR is a benchmark that `python -m bench.blind` has diagnosed and scored (`run`, `score`). Every
clear case that is not first, or not among the ties, is searched again, and what is concealed is
held against what was found, on the same residuals, block by block, each fitted to other blocks.
Where what is concealed explains no more, nothing in the recording speaks for it, and whoever
reports it has guessed.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from bench.blind.scoring.outcome import ABSORBING, Outcome, judge
from bench.blind.scoring.page import listed
from bench.blind.scoring.scorecard import is_clear
from bench.blind.scoring.share import share_of, share_words
from bench.blind.stored_results import read_results
from bench.blind.truth import RECORDINGS, read_truth
from bench.markdown import markdown_table
from bench.page import into_page
from cspm.campaign.cluster import worker_pool
from cspm_ident.diagnosis.regression.block_regression import Gain, gain_of
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, freedom, shapes_of
from cspm_ident.diagnosis.residuals.machine_scales import of_size
from cspm_ident.diagnosis.residuals.regressors import Candidate
from cspm_ident.diagnosis.selection.search import Search
from cspm_ident.diagnosis.selection.search_pass import Recordings, searched_for
from cspm_ident.signals.measurement import read_measurement
from cspm_sim.effects import catalogue

PAGE = Path(__file__).resolve().parents[2] / "results" / "misses.md"
# Standard errors of the scatter between blocks.
SIGNIFICANT_ERRORS = 2.0
NO_COLUMN, GIVEN_UP, MORE, SIMPLER, NO_MORE = REASONS = (
    "the recording has no trace of it",
    "found, but not reported",
    "explains significantly more than what was found",
    "explains as much with fewer numbers",
    "explains no more than what was found",
)
# Those of which a recording shows nothing.
HIDDEN = (NO_COLUMN, NO_MORE)
_MEASURES = {
    "block": "block found",
    "first": "effect and elements named first",
    "tied": "truth among the ties",
}

Array = NDArray[np.float64]
Data = Mapping[str, Any]


class Miss(NamedTuple):
    """What speaks for the truth of a case that was missed.

    Attributes:
        outcome: how it was scored.
        gain: by how much the truth explains more than what was found; None without a column.
        of: the squares that what was found explains, in the same unit.
        reason: one of `REASONS`.
    """

    outcome: Outcome
    gain: Gain | None
    of: float
    reason: str


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.blind.misses", description=__doc__)
    parser.add_argument("folder", type=Path, help="a blind benchmark with its results")
    parser.add_argument("truth", type=Path, help="its truth file")
    parser.add_argument("--page", action="store_true", help="renew results/misses.md")
    options, console = parser.parse_args(), Console()
    items = {item["name"]: item for item in read_truth(options.truth)["items"]}
    results = read_results(options.folder, list(items))
    outcomes = [judge(items[name], results[name], {}) for name in results]
    clear = [o for o in outcomes if is_clear(o.kind, o.multiple)]
    missed = [o for o in clear if not (o.block and o.first and o.tied)]
    misses = []
    with worker_pool() as pool:
        tasks = [
            pool.submit(miss_of, o, items[o.name], options.folder / RECORDINGS / o.name)
            for o in missed
        ]
        for done, task in enumerate(tasks, start=1):
            misses.append(task.result())
            console.print(f"{done} of {len(missed)}: {misses[-1].outcome.name}", markup=False)
    for name, text in {"reach": reach_table(clear, misses), "misses": miss_table(misses)}.items():
        console.print(text, markup=False, soft_wrap=True)
        if options.page:
            into_page(PAGE, name, text)


def miss_of(outcome: Outcome, item: Data, recording: Path) -> Miss:
    """Search a recording again and hold what is concealed against what was found."""
    given = Recordings([read_measurement(recording)], [])
    effects = of_size(catalogue().values(), given.searched)
    look, found = searched_for(given, effects, lambda _: None)
    return compared(outcome, item, look.search, [each.hypothesis for each in found.findings])


def compared(outcome: Outcome, item: Data, search: Search, found: Sequence[Hypothesis]) -> Miss:
    """Return what speaks for what is concealed, beside what healthy clocks do.

    Args:
        outcome: how the case was scored.
        item: of the truth file.
        search: through the recording's residuals.
        found: what it has found.
    """
    fits = search.fits
    negligible = [h for h in found if fits.is_negligible(h, found)]
    reported = fits.sums.held_out(fits.columns(found))
    squares = float(np.sum(fits.sums.held_out(fits.columns(negligible)) - reported))
    true = nearest_truth(search, item, negligible)
    if true is None:
        return Miss(outcome, None, squares, NO_COLUMN)
    gain = gain_of(reported - _left(search, true, negligible))
    names = {(h.effect.id, e) for h in found for e in h.elements}
    if {(h.effect.id, e) for h in true for e in h.elements} <= names:
        return Miss(outcome, gain, squares, GIVEN_UP)
    reported_numbers = _numbers([h for h in found if h not in negligible])
    return Miss(outcome, gain, squares, reason_of(gain, _numbers(true), reported_numbers))


def reason_of(gain: Gain, true: int, reported: int) -> str:
    """Return what speaks for the truth, by what it explains more and by the numbers of both."""
    if gain.total > SIGNIFICANT_ERRORS * gain.error:
        return MORE
    alike = gain.total >= -SIGNIFICANT_ERRORS * gain.error
    return SIMPLER if alike and true < reported else NO_MORE


def nearest_truth(
    search: Search, item: Data, beside: Sequence[Hypothesis]
) -> list[Hypothesis] | None:
    """Return what is concealed as the catalogue has it, of the shapes that explain most.

    With the number of the file that hides it, if one does. None where one of its elements has no
    column.
    """
    concealed = list(item["concealed"])
    if item["absorbed_by"]:
        number = ABSORBING[item["absorbed_by"]]
        concealed += [{"effect": number, "elements": e["elements"]} for e in item["concealed"]]
    forms = [_forms(search, each) for each in concealed]
    if not all(forms):
        return None
    start = float(item.get("onset_s", 0.0))
    onset = int(np.argmin(np.abs(search.gram.times - start))) if start else 0
    options = [[replace(h, onset=onset) for h in option] for option in product(*forms)]
    return min(options, key=lambda option: float(_left(search, option, beside).sum()))


def _forms(search: Search, concealed: Data) -> list[Hypothesis]:
    """Return an effect on its elements, in every shape that it has on all of them."""
    effect = catalogue()[concealed["effect"]]
    places = tuple(Candidate(effect, element) for element in concealed["elements"])
    return shapes_of(Hypothesis(effect, places), search.heard)


def _left(search: Search, true: Sequence[Hypothesis], beside: Sequence[Hypothesis]) -> Array:
    """Return Σ residual² of each block beside what is true, not fitted to it."""
    fits = search.fits
    own = search.gram.columns_of(c for h in true for c in h.candidates)
    late = fits.sums.delayed(own, max(h.onset for h in true))
    return late.held_out(fits.columns([*true, *beside]))


def _numbers(hypotheses: Sequence[Hypothesis]) -> int:
    return sum(map(freedom, hypotheses)) + len(hypotheses)


def reach_table(clear: Sequence[Outcome], misses: Sequence[Miss]) -> str:
    """Return, by what was missed, why, and what there was to reach."""
    rows = []
    for key, label in _MEASURES.items():
        own = Counter(m.reason for m in misses if not getattr(m.outcome, key))
        hits, hidden = sum(getattr(o, key) for o in clear), sum(own[reason] for reason in HIDDEN)
        most = len(clear) - hidden
        words = [share_words(share_of(n, len(clear))) for n in (hits, most)]
        rows.append((label, words[0], *(str(own[reason]) for reason in REASONS), words[1]))
    heads = ("", "found", *REASONS, "if all but what is hidden were right")
    return markdown_table(heads, rows)


def miss_table(misses: Sequence[Miss]) -> str:
    """Return every miss with what speaks for its truth."""
    rows = [
        (
            m.outcome.name,
            m.outcome.stratum,
            listed(m.outcome.truth),
            listed(m.outcome.found) or m.outcome.verdict,
            ", ".join(key for key in _MEASURES if not getattr(m.outcome, key)),
            "—" if m.gain is None else f"{m.gain.total:.0f} ± {m.gain.error:.0f} of {m.of:.0f}",
            m.reason,
        )
        for m in sorted(misses, key=lambda m: (REASONS.index(m.reason), m.outcome.stratum))
    ]
    heads = ("recording", "stratum", "concealed", "reported", "missed", "explains more by", "it")
    return markdown_table(heads, rows)


if __name__ == "__main__":
    main()
