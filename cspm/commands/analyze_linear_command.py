"""What `cspm analyze linear` does."""

from __future__ import annotations

from math import tau
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from cspm.commands.analyzed_machine import AnalyzedMachine
from cspm.commands.claim_table import claim_table
from cspm_control.analysis.claim import Claim
from cspm_control.analysis.gain import condition
from cspm_control.analysis.linear import (
    LOW,
    LinearAnalyses,
    LinearAnalysis,
    SubsystemAnalysis,
    analyse_linear,
)
from cspm_control.analysis.published_linear import EXACT, FROZEN, linear_claims
from cspm_model.linearisation import StateSpace
from cspm_msgs_py.new_folder import refuse_existing
from cspm_run.console import make_console, say
from cspm_run.summary import write_json

PICTURE = "linear.png"
MODEL = "model.json"
HEADINGS = {FROZEN: "ours, directions held", EXACT: "ours, exact"}


def analyze_linear_command(
    machine: AnalyzedMachine, folder: Path | None, json: Path | None
) -> None:
    """Analyse, print, and write what was asked for.

    Raises:
        CspmError: the folder exists, or the bar cannot hang at this pose.
    """
    refuse_existing(folder)
    console = make_console()
    found = analyse_linear(machine.testbed, machine.pose)
    names = machine.testbed.cable_names
    claims = linear_claims(found, names) if machine.is_published else []
    _show(console, machine, found, claims)
    if folder is not None:
        from cspm.plots.linear_figure import draw_linear

        folder.mkdir(parents=True)
        draw_linear(folder / PICTURE, found, names)
        write_json(folder / MODEL, _models_data(found))
        say(console, f"written {folder / PICTURE}, {folder / MODEL}")
    if json is not None:
        write_json(json, _data(machine, found, claims))


def _show(
    console: Console, machine: AnalyzedMachine, found: LinearAnalyses, claims: list[Claim]
) -> None:
    pose = ", ".join(f"{value:.4g}" for value in found.point.bar_pose)
    say(console, f"{machine.testbed.name} at rest at [{pose}] (m, rad); rank of Jᵀ {found.rank}")
    tensions = zip(machine.testbed.cable_names, found.point.tensions, strict=True)
    say(console, f"tensions [N]: {', '.join(f'{name} {value:.3f}' for name, value in tensions)}")
    for title, analysis in (
        ("cable directions held, as in the thesis", found.frozen),
        ("exact: cables turn", found.exact),
    ):
        console.print(_mode_table(title, analysis))
        if analysis.drifting:
            say(console, f"{analysis.drifting} poles at zero: nothing pulls these motions back")
        for name, part in (("motion", analysis.motion), ("tension", analysis.tension)):
            gains = ", ".join(f"{gain:.4g}" for gain in part.low.gains)
            say(
                console,
                f"{name} sub-system at {LOW:g} rad/s: σ {gains};"
                f" condition {condition(part.low.gains):.4g}",
            )
            say(console, f"  most: {_direction(part, 0)}; least: {_direction(part, -1)}")
    if claims:
        console.print(claim_table("the thesis's chapter 6", claims, HEADINGS))


def _mode_table(title: str, analysis: LinearAnalysis) -> Table:
    table = Table(title=title, box=box.SIMPLE_HEAD)
    for heading in ("rad/s", "Hz", "damping ratio"):
        table.add_column(heading, justify="right")
    table.add_column("what moves")
    for mode in analysis.modes:
        table.add_row(
            f"{mode.frequency:.4g}",
            f"{mode.frequency / tau:.3g}",
            f"{mode.damping:.2g}" if mode.pole.imag > 0.0 else "1, decays",
            mode.words,
        )
    return table


def _direction(part: SubsystemAnalysis, i: int) -> str:
    """Return which input goes to which output, the largest entries in words."""
    system, low = part.system, part.low

    def largest(names: tuple[str, ...], column: Any) -> str:  # noqa: ANN401 - an array
        order = abs(column).argsort()[::-1][:2]
        kept = [k for k in order if abs(column[k]) >= 0.01]
        return " and ".join(f"{abs(column[k]):.3f} {names[k]}" for k in kept)

    return (
        f"{largest(system.inputs, low.inputs[:, i])} → {largest(system.outputs, low.outputs[:, i])}"
    )


def _models_data(found: LinearAnalyses) -> dict[str, Any]:
    return {
        way: {
            name: _model_data(model)
            for name, model in (
                ("plant", analysis.model),
                ("motion", analysis.motion.system),
                ("tension", analysis.tension.system),
            )
        }
        for way, analysis in ((FROZEN, found.frozen), (EXACT, found.exact))
    }


def _model_data(model: StateSpace) -> dict[str, Any]:
    matrices = {name: getattr(model, name).tolist() for name in "ABCD"}
    return {**matrices, "states": model.states, "inputs": model.inputs, "outputs": model.outputs}


def _data(machine: AnalyzedMachine, found: LinearAnalyses, claims: list[Claim]) -> dict[str, Any]:
    point = found.point
    return {
        "testbed": machine.testbed.name,
        "pose": point.bar_pose.tolist(),
        "tensions": dict(zip(machine.testbed.cable_names, point.tensions.tolist(), strict=True)),
        "rank": found.rank,
        FROZEN: _analysis_data(found.frozen),
        EXACT: _analysis_data(found.exact),
        "claims": [claim.data() for claim in claims],
    }


def _analysis_data(analysis: LinearAnalysis) -> dict[str, Any]:
    return {
        "modes": [
            {
                "pole": [mode.pole.real, mode.pole.imag],
                "frequency": mode.frequency,
                "damping": mode.damping,
                "shape": mode.words,
            }
            for mode in analysis.modes
        ],
        "poles_at_zero": analysis.drifting,
        "motion": _subsystem_data(analysis.motion),
        "tension": _subsystem_data(analysis.tension),
    }


def _subsystem_data(part: SubsystemAnalysis) -> dict[str, Any]:
    return {
        "at_rad_s": LOW,
        "singular_values": part.low.gains.tolist(),
        "condition": condition(part.low.gains),
        "relative_gains": part.relative[0].real.tolist(),
    }
