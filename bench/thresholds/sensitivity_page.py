"""The page `results/thresholds-sensitivity.md`, from what moving thresholds changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bench.thresholds.development_set import Development
from bench.thresholds.move import Move
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS

_HEAD = """\
# What moving a threshold changes

Each threshold of the diagnosis ([thresholds.md](../docs/reference/thresholds.md))
was moved down and up by half of
its value, clipped to its range, alone. The recordings are a fixed set with planted effects:

{cases}

A cell has the most important change in `diagnosis.json`: the verdict, else the findings, else
their alternatives, else numbers alone. *Nothing* is an identical file. *Not read* means that the
diagnosis of that recording never uses the threshold. *Refused* means one line of error.

Written by `python -m bench.thresholds`.
"""
_SAME = {"nothing", "not read"}
Changes = Mapping[str, Mapping[Move, str]]


def sensitivity_page(cases: Sequence[Development], changes: Changes) -> str:
    """Return the page in Markdown.

    Args:
        cases: recordings of the set that were diagnosed.
        changes: by name of a recording, what each move changes.
    """
    parts = [_HEAD.format(cases="\n".join(map(_case, cases)))]
    parts += [_silent(changes), _table(cases, changes)]
    return "\n".join(parts)


def _case(case: Development) -> str:
    planted = ", ".join(
        f"`{each.effect}`" + (f" on {', '.join(each.elements)}" if each.elements else "")
        for each in case.planted
    )
    cells = "" if case.cells else ", without load cells"
    made = f"{case.scenario}, {case.duration:g} s, {case.plant} plant, seed {case.seed}"
    return f"- **{case.name}**: {planted or 'nothing'} ({made}{cells})."


def _silent(changes: Changes) -> str:
    """Return the thresholds that change nothing, and those that are not read, in words."""
    by_name: dict[str, set[str]] = {}
    for own in changes.values():
        for move, words in own.items():
            by_name.setdefault(move.name, set()).add(words)
    unread = [name for name, words in by_name.items() if words == {"not read"}]
    silent = [name for name, words in by_name.items() if words <= _SAME]
    same = [name for name in silent if name not in unread]
    return (
        f"## No change on this set\n\n{len(same)} of {len(by_name)} thresholds, read and without"
        f" effect within ±50 %: {_listed(same)}.\n\nNot read on this set: {_listed(unread)}.\n\n"
        "A rule whose threshold changes nothing here may still decide elsewhere: it can go only\n"
        "where its removal leaves every development result as it is.\n"
    )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"`{name}`" for name in names) or "none"


def _table(cases: Sequence[Development], changes: Changes) -> str:
    names = [case.name for case in cases]
    every = [
        move
        for move in next(iter(changes.values()), {})
        if any(changes[name][move] not in _SAME for name in names)
    ]
    rows = [
        f"| `{move.name}` | {DEFAULT_THRESHOLDS.values[move.name]:.4g} | {move.value:.4g} | "
        + " | ".join(changes[name][move] for name in names)
        + " |"
        for move in every
    ]
    head = f"| threshold | default | moved to | {' | '.join(names)} |"
    line = "|---|---:|---:|" + "---|" * len(names)
    return "\n".join(["## Moves that change something\n", head, line, *rows, ""])
