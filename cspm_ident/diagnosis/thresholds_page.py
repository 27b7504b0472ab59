"""The page `docs/reference/thresholds.md`, made from the thresholds themselves.

Run `python -m cspm_ident.diagnosis.thresholds_page > docs/reference/thresholds.md` after changing
one.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import Field, fields
from math import isfinite
from typing import Any

from cspm_ident.diagnosis.thresholds import GROUPS

_HEAD = """\
# Thresholds of the diagnosis

Every constant that decides what a diagnosis reports; all are fields of
`cspm_ident.diagnosis.thresholds.Thresholds`. Other values for one diagnosis:
`cspm.diagnose("recording", thresholds={"material_share": 0.1})`.
`diagnosis.json` lists those that were used under `thresholds`. Constants of the numerics alone,
such as lengths of filters and numbers of iterations, stay beside the code that uses them.

A *share* is a number from 0 to 1. A *gain* is the sum of squared residuals that an effect takes in
blocks of time that were not fitted. *Set by hand* means that neither statistics nor data gave the
value. What moving each value by half changes is in
[thresholds sensitivity](../../results/thresholds-sensitivity.md).

This page is generated:
`python -m cspm_ident.diagnosis.thresholds_page > docs/reference/thresholds.md`.
"""


def thresholds_page() -> str:
    """Return the page in Markdown, one table per stage of the diagnosis."""
    return "\n".join([_HEAD, *map(_section, GROUPS)])


def _section(group: type[Any]) -> str:
    title, text = (group.__doc__ or "").strip(), ["| name | value | allowed | meaning | basis |"]
    stage = group.__name__.removesuffix("Thresholds")
    rows = [_row(each) for each in fields(group)]
    return "\n".join([f"## {stage}\n\n{title}\n", *text, "|---|---|---|---|---|", *rows, ""])


def _row(own: Field[Any]) -> str:
    known = own.metadata
    unit = "" if known["unit"] in ("1", "count") else f" {known['unit']}"
    words = (f"`{own.name}`", f"{own.default:.4g}{unit}", allowed(known))
    return f"| {' | '.join(words)} | {known['meaning']} | {known['basis']} |"


def allowed(known: Mapping[str, Any]) -> str:
    """Return the range of a threshold in words, from its metadata."""
    if isfinite(known["high"]):
        return f"{known['low']:g} to {known['high']:g}"
    return f"{known['low']:g} or more"


def main() -> None:
    """Print the page."""
    sys.stdout.write(thresholds_page())


if __name__ == "__main__":
    main()
