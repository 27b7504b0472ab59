"""The page `docs/effects.md`, made from what each effect declares of itself.

Run `python -m cspm_sim.effects.document > docs/effects.md` after adding or changing an effect.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping

from cspm_sim.effects import Effect, catalogue

_HEAD = """\
# Effects

Physics beyond the thesis's model. Each effect is one file in `cspm_sim/effects/`; a test-bed
file switches it on under `effects:` (see [files.md](files.md)). Winch quantities are at the
motor shaft, bar quantities in world_ned at the origin of bar_ned.

This page is generated: `python -m cspm_sim.effects.document > docs/effects.md`.
"""


def effects_page(effects: Mapping[str, Effect]) -> str:
    """Return the page in Markdown, one section per effect in the order given."""
    lines = [_HEAD, "| id | block | parameters |", "|---|---|---|"]
    lines += [_summary(effect) for effect in effects.values()]
    return "\n".join([*lines, *(_section(effect) for effect in effects.values())]) + "\n"


def _summary(effect: Effect) -> str:
    names = ", ".join(parameter.name for parameter in effect.parameters)
    return f"| [`{effect.id}`](#{effect.id}) | {effect.block.value} | {names} |"


def _section(effect: Effect) -> str:
    bounds = [
        f"| `{p.name}` | {p.unit} | {p.minimum:g} to {p.maximum:g} |" for p in effect.parameters
    ]
    facts = {
        "Equation": effect.equation,
        "Shows": effect.shows,
        "Twins": _listed(effect.twins),
        "Told apart by": effect.separating_experiment,
        "Reference": effect.reference,
    }
    return "\n".join(
        [
            f"\n## {effect.id}\n",
            "| parameter | unit | allowed |",
            "|---|---|---|",
            *bounds,
            "",
            *(f"- {title}: {text}." for title, text in facts.items()),
        ]
    )


def _listed(ids: Iterable[str]) -> str:
    return ", ".join(f"`{twin}`" for twin in ids) or "none known"


if __name__ == "__main__":
    sys.stdout.write(effects_page(catalogue()))
