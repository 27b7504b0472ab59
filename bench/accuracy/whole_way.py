"""A machine drawn at random, taken from its file to a verdict."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import cspm
from bench.accuracy.drawn_machine import drawn_machine
from cspm.commands.view_command import ViewRequest, view_command
from cspm_run.output.console import VOICE, Voice

# Long enough that the circle turns each winch back.
DURATION = 24.0
# Of the torque limit, beyond what the file says.
PLANTED_SHARE = 0.02
EFFECT, PARAMETER = "winch_coulomb_friction", "torque"
HEADS = ("seed", "machine", "view", "planted", "verdict", "found, 95 % interval")


def whole_way(seed: int) -> tuple[str, ...]:
    """Return a row of a table of `HEADS`: what came of the machine of a seed."""
    drawn = drawn_machine(seed)
    drawn.scenario["duration"] = DURATION
    cable = drawn.testbed["cables"][seed % len(drawn.testbed["cables"])]
    value = PLANTED_SHARE * cable["torque_limit"]
    begin = (str(seed), _described(drawn.testbed), "", f"{value:.3g} N·m on {cable['name']}")
    with tempfile.TemporaryDirectory() as place:
        path = drawn.save(Path(place))
        testbed = path.parent / drawn.scenario["testbed"]
        try:
            worn = _with_friction(testbed, cable["name"], value)
            recording = cspm.simulate(path, testbed=worn).save(path.parent / "worn")
            view = "written" if _viewed(recording.path, path.parent / "page.html") else "empty"
            found = cspm.diagnose(recording, testbed=testbed, closed_loop=False)
        except Exception as error:
            return (*begin, "broken", repr(error))
    return (*begin[:2], view, begin[3], found.verdict, _said(found, cable["name"], value))


def _with_friction(path: Path, cable: str, value: float) -> cspm.Testbed:
    """Return the machine with more Coulomb friction [N·m] in one winch."""
    machine = cspm.load_testbed(path)
    (known,) = machine.effects
    others = [name for name in machine.cables if name != cable]
    bare = machine.without_effect(EFFECT)
    return bare.with_effect(EFFECT, *others, **known.numbers).with_effect(
        EFFECT, cable, **{PARAMETER: known.numbers[PARAMETER] + value}
    )


def _viewed(recording: Path, page: Path) -> bool:
    VOICE.set(Voice.NOWHERE)
    view_command(ViewRequest([recording], None, None, page, "127.0.0.1", None, False), None)
    return page.stat().st_size > 0


def _said(found: cspm.Diagnosis, cable: str, value: float) -> str:
    lines = []
    for each in found.findings:
        number = each.parameters.get(PARAMETER)
        if (each.effect, each.elements) == (EFFECT, (cable,)) and number and number.ci95:
            low, high = number.ci95
            mark = "" if low <= value <= high else " ✗"
            lines.append(f"{number.value:.3g} ({low:.3g} to {high:.3g}){mark}")
        else:
            lines.append(f"{each.effect} on {', '.join(each.elements)} ✗")
    return "; ".join(lines) or "nothing ✗"


def _described(testbed: dict[str, Any]) -> str:
    cables = testbed["cables"]
    first = cables[0]
    pulley = ", pulleys" if "pulley" in first else ""
    parts = f", {first['parts']} parts" if first["parts"] > 1 else ""
    return (
        f"{len(cables)} cables, {testbed['bar']['mass']:.3g} kg, gear {first['gear_ratio']:.2g}"
        f"{pulley}{parts}"
    )
