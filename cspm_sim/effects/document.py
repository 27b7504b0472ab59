"""The page `docs/reference/effects.md`, made from what each effect declares of itself.

Run `python -m cspm_sim.effects.document > docs/reference/effects.md` after adding or changing
an effect.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping

from cspm_sim.effects import Effect, EffectParameter, Elements, catalogue

_HEAD = """\
# Effects

Physics beyond the thesis's model. Each effect is one file in `cspm_sim/effects/`; a test-bed
file switches it on under `effects:` (see
[the test-bed file](testbed-file.md)). Winch quantities are at the
motor shaft, bar quantities in world_ned at the origin of bar_ned. In the equations q is the motor
angle, n the gear ratio, r the drum's radius, t the tension, ε the elongation.

*Absent at* is the value at which an effect does nothing: it is then left out altogether. Effects of
several entries add up; one with memory acts once per element. Effects of block `sensor` change what
is measured and nothing else. *Searched over* lists the values at which a diagnosis looks for a
parameter that does not enter the residual as a factor. *Usual* ranges and these values are those of
a machine of the thesis's size, with torques of 0.35 N·m, 100 rad/s, 15 N and cables of 2 m. Where
the recorded ones are of another order of magnitude, a diagnosis multiplies them by powers of ten. A
file may go a million times beyond where a number has a dimension. Controllers and their design
know the test-bed without its effects.

What no effect of this list explains can be described by a table of values: effect `empirical`,
whose keys are in [the test-bed file](testbed-file.md).
A diagnosis writes such tables; they explain nothing, and
another machine or motion may need others.

This page is generated: `python -m cspm_sim.effects.document > docs/reference/effects.md`.
Which sensors separate
which effects is in [isolability](isolability.md), how to add one of your own in
[add an effect](../how-to/add-an-effect.md).
"""

_PICTURES = """
## Signatures

What a little of each effect adds to the residual in which it shows most, against the measured
signal that explains most of it, along the worst case; the largest value is 1. Backlash and a lag of
a drive show nowhere along that planned motion, without slack and commands: they are drawn along
`worst_case_4m` as simulated. Drawn by `python docs/scripts/draw_signatures.py`.

![Signatures of effects on winches](../figures/signatures_winch.png)

![Signatures of effects on cables](../figures/signatures_cable.png)

![Signatures of effects on the bar](../figures/signatures_bar.png)

![Signatures of effects on winch frame and sensors](../figures/signatures_frame_and_sensor.png)"""

_ELEMENTS = {
    Elements.CABLES: "named cables, all where none is named",
    Elements.BAR: "`bar`",
    Elements.FRAME: "`winch_frame`",
    Elements.BODIES: "`bar`, `winch_frame`, both where none is named",
    Elements.CELLS: "named cables, each cell by itself; `load_cells` or none named: all together",
}


def effects_page(effects: Mapping[str, Effect]) -> str:
    """Return the page in Markdown, one section per effect in the order given."""
    lines = [_HEAD, "| id | block | parameters |", "|---|---|---|"]
    lines += [_summary(effect) for effect in effects.values()]
    lines.append(_PICTURES)
    return "\n".join([*lines, *(effect_section(effect) for effect in effects.values())]) + "\n"


def _summary(effect: Effect) -> str:
    names = ", ".join(parameter.name for parameter in effect.parameters)
    return f"| [`{effect.id}`](#{effect.id}) | {effect.block.value} | {names} |"


def effect_section(effect: Effect) -> str:
    """Return all that an effect declares, in Markdown."""
    states, words = effect.physics.states, effect.description
    facts = {
        "Acts on": _ELEMENTS[effect.acts_on],
        "Equation": words.equation,
        "Memory": f"{states} states per element" if states else "none",
        "Residual": effect.signature.regression.channel.value,
        "Shows": words.shows,
        "Searched over": _grids(effect) or "nothing, all parameters are factors",
        "Confounded with": _listed(words.confounded_with),
        "Separated by": words.separating_experiment,
        "Reference": words.reference,
    }
    return "\n".join(
        [
            f"\n## {effect.id}\n",
            "| parameter | unit | usual | absent at | meaning |",
            "|---|---|---|---|---|",
            *(_row(parameter) for parameter in effect.parameters),
            "",
            *(f"- {title}: {text}." for title, text in facts.items()),
        ]
    )


def _row(p: EffectParameter) -> str:
    absent = "" if p.absent is None else f"{p.absent:g}"
    bounds = f"{p.minimum:g} to {p.maximum:g}"
    texts = [p.meaning] if p.meaning else []
    texts += [f"{p.default:g} where a file leaves it out"] if p.default is not None else []
    texts += [f"usually wrong by {p.usual:g}"] if p.usual is not None else []
    return f"| `{p.name}` | {p.unit} | {bounds} | {absent} | {'; '.join(texts)} |"


def _grids(effect: Effect) -> str:
    return "; ".join(
        f"`{name}` {', '.join(f'{value:g}' for value in grid)}"
        for name, grid in effect.signature.nonlinear.items()
    )


def _listed(ids: Iterable[str]) -> str:
    return ", ".join(f"`{other}`" for other in ids) or "none known"


if __name__ == "__main__":
    sys.stdout.write(effects_page(catalogue()))
