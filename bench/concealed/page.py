"""The board: all methods on all cases, and every miss."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from bench.blind.scoring.outcome import OUTSIDE, Outcome
from bench.blind.scoring.share import Share
from bench.concealed.case import AS_IT_IS, SPIKE
from bench.concealed.score import Group, groups, is_abstained
from bench.markdown import markdown_table

_HEADS = (
    *("method", "cases", "of", "named first", "among ties", "false"),
    *("abstained", "interval holds", "error ≤ 1.5 ×", "seconds"),
)
_CURVES = (
    ("first", "named first", "C0"),
    ("tied", "among the ties", "C2"),
    ("false", "something false named", "tab:red"),
    ("held", "interval holds what was added", "C1"),
)


def board(outcomes: Mapping[str, Sequence[Outcome]]) -> str:
    """Return the table of all methods in Markdown."""
    rows = []
    for method, own in outcomes.items():
        seconds = f"{median(o.seconds for o in own):.1f}" if own else ""
        for group in groups(own):
            rows.append((method, *_cells(group), seconds))
    return markdown_table(_HEADS, rows)


def _cells(group: Group) -> tuple[str, ...]:
    label = f"{group.label} {group.size:g} ×" if group.label == SPIKE else group.label
    shares = group[2:]
    return (label, f"{group.false.cases:g}", *(_words(each) for each in shares))


def _words(found: Share) -> str:
    return f"{found.hits:g} of {found.cases:g}" if found.cases else "–"


def misses(outcomes: Sequence[Outcome]) -> str:
    """Return what was not named, or named wrongly, in Markdown."""
    rows = [(o.name, _wrong(o), o.verdict, _found(o)) for o in outcomes if _wrong(o)]
    return markdown_table(("case", "what is wrong", "verdict", "named"), rows)


def _wrong(outcome: Outcome) -> str:
    words = ["false"] if outcome.wrong else []
    if outcome.truth and outcome.kind != OUTSIDE:
        if not outcome.tied:
            words.append("abstained" if is_abstained(outcome) else "not named")
        elif not outcome.first:
            words.append("not first")
    if any(e.covered is False for e in outcome.estimates):
        words.append("outside the interval")
    return ", ".join(words)


def _found(outcome: Outcome) -> str:
    return "; ".join(effect for effect, _ in outcome.found) or "nothing"


def draw_curve(path: Path, outcomes: Sequence[Outcome]) -> None:
    """Draw what is named of spikes against their size."""
    found = groups(outcomes)
    spikes = [group for group in found if group.label == SPIKE]
    figure = Figure(figsize=(8.0, 4.6), layout="constrained")
    axes = figure.subplots()
    for key, label, colour in _CURVES:
        known = [g for g in spikes if getattr(g, key).cases]
        values = [getattr(g, key).hits / getattr(g, key).cases for g in known]
        axes.plot([g.size for g in known], values, "o-", color=colour, label=label)
    for group in (g for g in found if g.label == AS_IT_IS):
        value = group.false.hits / group.false.cases
        axes.plot([0.0], [value], "s", color="tab:red", label="false where nothing is concealed")
    axes.set(ylim=(-0.03, 1.03), ylabel="share of cases")
    axes.set_xlabel("added effect, in RMS of what is unexplained in the recording")
    axes.set_title("Known effects added to real recordings")
    figure.legend(loc="outside lower center", ncols=3)
    axes.grid(alpha=0.3)
    FigureCanvasAgg(figure).print_figure(path, dpi=110)
