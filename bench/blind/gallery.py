"""Three concealed machines in pictures, by `python -m bench.blind.gallery`: results/gallery.md.

They are the first ones that a seed draws in three strata of the blind benchmark, whatever the
diagnosis says of them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.console import Console

from bench.blind.make import Request, make
from bench.blind.truth import RECORDINGS
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.diagnosis import Diagnosis
from cspm_ident.diagnosis.reporting.finding_statement import statement_of
from cspm_ident.diagnosis.reporting.statement import line_statement, unknown_statement
from cspm_ident.diagnosis.reporting.verdict import verdict_of
from cspm_ident.diagnosis.validation.residual_curves import Curve
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.recording.reader import Recording
from cspm_sim.effects import catalogue

ROOT = Path(__file__).resolve().parents[2]
PAGE, FIGURES = ROOT / "results" / "gallery.md", ROOT / "docs" / "figures"
STRATA = ("feedback", "combined", "outside")
SEED, DURATION_S = 3, 30.0
_DPI = 90
_DOTS: dict[str, Any] = {"linestyle": "", "marker": ".", "markersize": 3, "alpha": 0.4}
# What is drawn later is smaller, so that equal values are seen.
_STAGES = (
    ("before", "as described", "o", 10, "tab:red"),
    ("retuned", "re-tuned", "s", 7, "tab:orange"),
    ("after", "with what was found", "D", 4, "tab:green"),
)


def main() -> None:
    """Record, diagnose and draw."""
    parser = argparse.ArgumentParser(description="Draw three concealed machines.")
    parser.add_argument("--seed", type=int, default=SEED, help="of what is drawn")
    parser.add_argument("--keep", type=Path, help="folder in which the recordings stay")
    arguments = parser.parse_args()
    seed, console, parts = arguments.seed, Console(), []
    with ScratchFolder("gallery") as place:
        for k, stratum in enumerate(STRATA, start=1):
            folder = (arguments.keep or place) / stratum
            truth = folder.with_suffix(".json")
            with console.status(f"{stratum}: recording"):
                make(Request(folder, truth, seed, 1, "dev", (stratum,), DURATION_S))
            (item,) = json.loads(truth.read_text(encoding="utf-8"))["items"]
            path = folder / RECORDINGS / item["name"]
            with console.status(f"{stratum}: diagnosing"):
                found = diagnose([read_measurement(path)])
            draw_case(FIGURES / f"gallery_{k}.png", path, found)
            parts.append(_text(k, stratum, item, found))
            console.print(f"{stratum}: {verdict_of(found).value}")
    PAGE.write_text(_HEAD.format(seed=seed) + "\n".join(parts), encoding="utf-8")


_HEAD = """# Three concealed machines

The first machines that seed {seed} draws in three strata of the
[blind benchmark](../docs/explanation/blind-benchmark.md),
shown whatever the diagnosis says of them; 30 s each, sensors with coloured noise, jitter, dropouts
and clocks of their own. Made by `python -m bench.blind.gallery`.

"""


def draw_case(path: Path, recording: Path, found: Diagnosis) -> None:
    """Draw what an engineer sees, what the diagnosis sees, and what the model then does."""
    figure = Figure(figsize=(12, 3.8), layout="constrained")
    FigureCanvasAgg(figure)
    seen, reported, fit = figure.subplots(1, 3)
    _draw_tracking(seen, recording)
    _draw_residual(reported, found)
    _draw_fit(fit, found)
    figure.legend(*fit.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=_DPI)


def _draw_tracking(axes: Axes, recording: Path) -> None:
    with Recording(recording) as opened:
        rows = opened.rows_of(["/bar/pose", "/bar/reference"])
    pose, wanted = rows["/bar/pose"], rows["/bar/reference"]
    times = (pose.stamp_ns - pose.stamp_ns[0]) * 1e-9
    for k, name in enumerate(("surge", "sway", "heave")):
        at = np.interp(pose.stamp_ns, wanted.stamp_ns, wanted.rows[:, k])
        axes.plot(times, 1e3 * (pose.rows[:, k] - at), linewidth=0.7, label=name)
    axes.set(title="What the engineer sees: tracking", xlabel="time [s]", ylabel="[mm]")
    axes.legend(fontsize="small", ncols=3)


def _draw_residual(axes: Axes, found: Diagnosis) -> None:
    """Draw the residual on held-out data that a finding lowers most, else the largest unknown."""
    unknown = [each.driver.place for each in found.unexplained[:1]]

    def rank(curve: Curve) -> tuple[bool, bool, float]:
        size = curve.gained if curve.touched else _size(curve)
        return bool(curve.touched), curve.place in unknown, size

    curve = max(found.curves, key=rank)
    name = curve.main_signal
    signal = curve.signals.get(name, curve.times)
    axes.plot(signal, curve.before, color="tab:red", **_DOTS)
    if curve.touched:
        axes.plot(signal, curve.after, color="tab:green", **_DOTS)
    place = f"{curve.place.element} {curve.component}".strip()
    axes.set(
        title=f"What it looks at: residual, {place}",
        xlabel=name or "time [s]",
        ylabel=f"[{curve.unit}]",
    )


def _size(curve: Curve) -> float:
    return float(np.std(curve.before) / max(np.std(curve.measured), 1e-300))


def _draw_fit(axes: Axes, found: Diagnosis) -> None:
    """Draw simulated errors on held-out data over what noise leaves, the four that gain most."""
    fits = sorted(found.simulated, key=lambda f: f.after / max(f.before, 1e-300))[:4]
    height = np.arange(len(fits))
    for name, label, marker, size, colour in _STAGES:
        shares = [getattr(f, name) / max(f.floor, 1e-300) for f in fits]
        axes.plot(shares, height, marker, markersize=size, color=colour, label=label)
    axes.axvline(1.0, color="black", linewidth=0.8, label="noise")
    axes.set_yticks(height, [f.output.name for f in fits])
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set(title="What the fit does, held out", xlabel="simulated error over noise")


def _text(k: int, stratum: str, item: Mapping[str, Any], found: Diagnosis) -> str:
    concealed = "; ".join(
        f"{c['effect'] or c['phenomenon'] + ' (not in the catalogue)'} on {_amounts(c)},"
        f" {c['multiple']:g} × its detection limit"
        for c in item["concealed"]
    )
    reported = [
        *_named(found),
        *(unknown_statement(found, each) for each in found.unexplained),
        *(line_statement(line) for line in found.lines),
    ]
    lines = "\n".join(f"- {sentence}" for sentence in reported) or "- nothing"
    return (
        f"## {k}. {stratum}, `{item['scenario']}`\n\n"
        f"Concealed: {concealed or 'nothing'}.\n\n"
        f"Verdict: **{verdict_of(found).value}**.\n\n{lines}\n\n"
        f"![{stratum}](../docs/figures/gallery_{k}.png)\n"
    )


def _named(found: Diagnosis) -> Iterator[str]:
    """Yield what is said of the findings, and their rivals."""
    for finding in found.reported:
        yield statement_of(found, finding)
        yield from (f"as well explained by {rival.words}" for rival in finding.alternatives)


def _amounts(concealed: Mapping[str, Any]) -> str:
    """Return on which elements it acts, with the parameter that the catalogue has for it."""
    name, values = concealed["parameter"], concealed["values"]
    if name is None:
        return ", ".join(concealed["elements"])
    unit = next(p.unit for p in catalogue()[concealed["effect"]].parameters if p.name == name)
    shown = "" if unit == "1" else f" {unit}"
    return ", ".join(f"{e} ({name} {values[e]:.3g}{shown})" for e in concealed["elements"])


if __name__ == "__main__":
    main()
