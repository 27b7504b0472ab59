"""Whether generated pages are what their commands write now."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path

from bench.validation.check import Check, Finding
from cspm_ident.experiment.isolability_page import angle_table, isolability_page, rich_measurement
from cspm_sim.effects import catalogue

DOCS = Path(__file__).resolve().parents[2] / "docs"
# Angles are the last printed digit apart from one processor to another.
NEAR_DEG = 1.0
_DASH = "—"
_NUMBERS = re.compile(r"<!-- numbers: (\w+) -->\n.*?<!-- end -->", re.DOTALL)
_PAIR = re.compile(r"^\| `(\w+)`, `(\w+)` \| (.*) \|$", re.MULTILINE)


def angles_of(text: str) -> dict[tuple[str, str], list[str]]:
    """Return the pairs of a page's tables with their angles as written."""
    return {(one, other): rest.split(" | ") for one, other, rest in _PAIR.findall(text)}


def apart(one: str, other: str) -> bool:
    """Return whether two angles as written are not the same one."""
    if _DASH in (one, other):
        return one != other
    return abs(float(one) - float(other)) > NEAR_DEG


def same_angles(committed: str, fresh: str) -> Finding:
    """Compare all angles of the page of isolability."""
    old, new = angles_of(committed), angles_of(fresh)
    pairs = old.keys() | new.keys()
    wrong = [pair for pair in pairs if _differ(old.get(pair, ()), new.get(pair, ()))]
    found = f"{len(wrong)} of {len(pairs)}"
    return Finding("docs/reference/isolability.md: pairs that differ", found, "0", not wrong)


def _differ(one: Sequence[str], other: Sequence[str]) -> bool:
    return any(apart(*each) for each in zip_longest(one, other, fillvalue=_DASH))


def numbers_in(text: str) -> Mapping[str, str]:
    """Return the marked blocks of a page by name."""
    return {match[1]: match[0] for match in _NUMBERS.finditer(text)}


def measure() -> list[Finding]:
    """Write the pages anew and compare."""
    sys.path.insert(0, str(DOCS / "scripts"))
    import model_numbers
    import winding_energy

    fresh = numbers_in(model_numbers.report() + winding_energy.report() + "\n<!-- end -->\n")
    page = numbers_in((DOCS / "explanation" / "model.md").read_text(encoding="utf-8"))
    wrong = [name for name in fresh.keys() | page.keys() if fresh.get(name) != page.get(name)]
    effects = catalogue()
    table = angle_table(rich_measurement(), list(effects.values()))
    found = f"{len(wrong)} of {len(page)}"
    return [
        Finding("docs/explanation/model.md: blocks that differ", found, "0", not wrong),
        same_angles(
            (DOCS / "reference" / "isolability.md").read_text(encoding="utf-8"),
            isolability_page(effects, table),
        ),
    ]


CHECKS = (
    Check(
        "Generated pages",
        "Pages whose numbers take minutes to compute, written anew and compared with the committed",
        measure,
    ),
)
