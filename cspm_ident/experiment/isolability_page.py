"""The page `docs/reference/isolability.md`: which effects which sensors can distinguish, computed.

Run `python -m cspm_ident.experiment.isolability_page > docs/reference/isolability.md` after
adding or
changing an effect.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cspm_ident.experiment.isolability import Sensors, angles, signatures
from cspm_ident.experiment.plan import planned
from cspm_ident.signals.measurement import Measurement
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.library import find_scenario
from cspm_sim.effects import Channel, Effect, catalogue

Array = NDArray[np.float64]
Pair = tuple[str, str]
Table = Mapping[Sensors, Mapping[Pair, float | None]]

CABLE = "sway_1"
DURATION_S = 30.0
# What the thesis's sensors leave in residuals of a nominal machine [N·m, N, N and N·m].
NOISE = {
    Channel.DRIVE: 1e-4,
    Channel.SHAFT: 1e-4,
    Channel.TENSION: 0.02,
    Channel.WRENCH: 0.05,
}
# Below this angle a pair is listed, declared as confounded or not.
NARROW_DEG = 15.0
_SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
_HEAD = """\
# Which sensors distinguish which effects

For every pair of [effects](effects.md) the smallest angle, in degrees, between what they can add to
the residuals of
[`cspm diagnose`](../how-to/diagnose.md) along a rich motion: {motion} of the worst case,
planned without simulation. At 0 some amount of the one looks exactly as some amount of the other,
however long the recording; at 90 they have nothing in common. A small angle asks for low noise or
for another motion. A dash: one of the two shows nowhere with these sensors. Effects on cables act
on `{cable}`; parameters that are searched on a grid stand in its middle. Residuals count in
multiples of {noise}.

Load cells sit on the free cable, on the bar's side of the exit pulley (*free*), or between drum
and pulley (*drum*). Without load cells the winches' torques stand for them, so that a winch's
faults show in its cable and in the bar's equation (*capture*); without motion capture as well
`cspm diagnose` has no residual of a winch with a cable.

This page is generated:
`python -m cspm_ident.experiment.isolability_page > docs/reference/isolability.md`.

## Pairs

Pairs declared as confounded, and every pair below {narrow:g}° with load cells and motion capture.
All other pairs are above that.

| pair | free, capture | drum, capture | free | drum | capture |
|---|---:|---:|---:|---:|---:|
"""
_SHOWN_HEAD = """
## What shows at all

| effect | free or drum, capture | free | drum | capture |
|---|---|---|---|---|
"""
_SETS = (
    Sensors.BAR_AND_CAPTURE,
    Sensors.DRUM_AND_CAPTURE,
    Sensors.BAR,
    Sensors.DRUM,
    Sensors.CAPTURE,
)


def rich_measurement() -> Measurement:
    """Return what the thesis's machine would read along the worst case, exactly."""
    path = find_scenario("worst_case_steep")
    scenario = load_scenario(path, [f"duration={DURATION_S}"])
    return planned(scenario, load_testbed(path.parent / scenario.testbed)).measurement


def angle_table(
    measurement: Measurement, effects: Sequence[Effect]
) -> dict[Sensors, dict[Pair, float | None]]:
    """Return the angle [°] of each pair of effects for each set of sensors."""
    out = {}
    for sensors in _SETS:
        found, equations = signatures(measurement, effects, CABLE, sensors)
        noise = {e.place: np.full(e.target.shape[1], NOISE[e.place.channel]) for e in equations}
        out[sensors] = angles(found, equations, noise)
    return out


def isolability_page(effects: Mapping[str, Effect], table: Table) -> str:
    """Return the page in Markdown."""
    noise = ", ".join(f"{NOISE[channel]:g} {unit}" for channel, unit in _UNITS.items())
    head = _HEAD.format(motion=f"{DURATION_S:g} s", cable=CABLE, noise=noise, narrow=NARROW_DEG)
    best = table[Sensors.BAR_AND_CAPTURE]
    pairs = [pair for pair in best if _is_listed(pair, effects, table)]
    pairs.sort(key=lambda pair: (best[pair] is None, best[pair] or 0.0, pair))
    rows = [f"| {' | '.join([_names(pair), *_angles(pair, table)])} |" for pair in pairs]
    shown = [f"| {' | '.join([f'`{name}`', *_visible(name, table)])} |" for name in effects]
    return head + "\n".join(rows) + "\n" + _SHOWN_HEAD + "\n".join(shown) + "\n"


_UNITS = {
    Channel.SHAFT: "N·m of torque",
    Channel.TENSION: "N of tension",
    Channel.WRENCH: "N or N·m of the bar's wrench",
}


def _is_listed(pair: Pair, effects: Mapping[str, Effect], table: Table) -> bool:
    one, other = pair
    declared = {id_: effects[id_].description.confounded_with for id_ in pair}
    if other in declared[one] or one in declared[other]:
        return True
    capture = (table[s][pair] for s in (Sensors.BAR_AND_CAPTURE, Sensors.DRUM_AND_CAPTURE))
    return any(angle is not None and angle < NARROW_DEG for angle in capture)


def _names(pair: Pair) -> str:
    return ", ".join(f"`{name}`" for name in pair)


def _angles(pair: Pair, table: Table) -> Iterable[str]:
    for sensors in _SETS:
        angle = table[sensors][pair]
        yield "—" if angle is None else f"{angle:.0f}"


def _visible(name: str, table: Table) -> Iterable[str]:
    for sensors in (Sensors.BAR_AND_CAPTURE, Sensors.BAR, Sensors.DRUM, Sensors.CAPTURE):
        own = (angle for pair, angle in table[sensors].items() if name in pair)
        yield "yes" if any(angle is not None for angle in own) else "no"


if __name__ == "__main__":
    known = catalogue()
    everything = angle_table(rich_measurement(), list(known.values()))
    sys.stdout.write(isolability_page(known, everything))
