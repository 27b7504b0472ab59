"""Draw `signatures_*.png`: what each effect adds to its residual along the worst case.

What shows nowhere along it, planned as it is without commands and slack, is drawn along 30 s of
`worst_case_4m` as simulated, at the cable that is slack for longest. Run
`python docs/scripts/draw_signatures.py`.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.validation.residual_curves import explained_by
from cspm_ident.experiment.isolability import Sensors, Signature, signatures
from cspm_ident.experiment.isolability_page import CABLE, NOISE, rich_measurement
from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.recorded_run import run
from cspm_sim.effects import Block, Effect, catalogue

COLUMNS = 4
POINTS = 900
ROOT = Path(__file__).resolve().parents[2]
SCENARIOS, FIGURES = ROOT / "scenarios", ROOT / "docs" / "figures"
# Explained by a signal so far, an effect is drawn against it.
EXPLAINED = 0.3
# Of the samples: what has a short period is drawn against so much of a signal's range.
CLOSE = 0.1
# Of a time that shows nothing but spikes, this much around the largest [s].
AROUND_S = 1.0
TIME = "time [s]"
SHEETS = {
    "winch": (Block.WINCH,),
    "cable": (Block.CABLE,),
    "bar": (Block.BAR,),
    "frame_and_sensor": (Block.FRAME, Block.SENSOR),
}


def strongest(signature: Signature) -> tuple[Place, int, int] | None:
    """Return the residual, its channel and the coefficient to draw; None: an effect shows nowhere.

    The first coefficient that shows, in the channel in which it stands out most.
    """
    sizes = {
        (place, i, k): float(np.linalg.norm(columns[:, i, k])) / NOISE[place.channel]
        for place, columns in signature.columns.items()
        for i, k in np.ndindex(columns.shape[1:])
    }
    first = min((k for (_, _, k), size in sizes.items() if size > 0.0), default=None)
    own = [each for each in sizes if each[2] == first]
    return max(own, key=lambda each: sizes[each], default=None)


def against(
    signals: dict[str, np.ndarray], times: np.ndarray, values: np.ndarray
) -> tuple[str, np.ndarray]:
    """Return the signal to draw values against, or the time, and which rows of them."""
    whole = np.ones(len(values), dtype=np.bool_)
    shares = {name: explained_by(signal, values) for name, signal in signals.items()}
    best = max(shares, key=lambda each: shares[each], default=TIME)
    if shares.get(best, 0.0) >= EXPLAINED:
        return best, whole
    for name, signal in signals.items():
        low, high = np.quantile(signal, [0.5 - 0.5 * CLOSE, 0.5 + 0.5 * CLOSE])
        rows = (signal >= low) & (signal <= high)
        if explained_by(signal[rows], values[rows]) >= 1.0 - EXPLAINED:
            return name, rows
    moment = times[int(np.argmax(np.abs(values)))]
    rare = np.mean(np.abs(values) > EXPLAINED * np.abs(values).max()) < CLOSE
    return TIME, np.abs(times - moment) < AROUND_S if rare else whole


def slack_measurement() -> tuple[Measurement, str]:
    """Return what is measured where cables go slack, and the cable that is so for longest."""
    path = SCENARIOS / "worst_case_4m.yaml"
    scenario = load_scenario(path, ["duration=30", "sensors=ideal"])
    machine = load_testbed(path.parent / scenario.testbed)
    with TemporaryDirectory() as folder:
        bundle = make_bundle(resolve(scenario, machine.testbed), machine, path.parent)
        run(bundle, Path(folder) / "slack")
        found = read_measurement(Path(folder) / "slack")
    assert found.tension is not None
    slack = np.mean(found.tension.values <= 0.0, axis=0)
    return found, found.machine.cable_names[int(np.argmax(slack))]


def draw(axes: Axes, effect: Effect, signature: Signature, places: dict[Place, Equation]) -> None:
    """Draw a coefficient of an effect against the signal that explains most of it."""
    axes.set_title(effect.id, fontsize=8)
    axes.tick_params(labelsize=6, length=2)
    where = strongest(signature)
    assert where is not None, f"{effect.id} shows nowhere"
    place, channel, coefficient = where
    values = signature.columns[place][:, channel, coefficient]
    equation = places[place]
    names = [n for n in equation.signals if not n.startswith("time")]
    if len(signature.columns[place][0]) > 1:
        names = [n for n in names if DOFS[channel] in n]
    name, rows = against({n: equation.signals[n] for n in names}, equation.times, values)
    x = equation.times if name == TIME else equation.signals[name]
    x, values = x[rows], values[rows]
    step = max(1, len(values) // POINTS)
    style = "-" if name == TIME else "."
    shown = values / np.abs(values).max()
    axes.plot(x[::step], shown[::step], style, markersize=1.5, linewidth=0.5, color="#1f6fb4")
    what = place.channel.name.lower() + (f" {DOFS[channel]}" if place.element == "bar" else "")
    axes.set_xlabel(name, fontsize=7, labelpad=1)
    axes.set_ylabel(what, fontsize=7, labelpad=1)
    axes.axhline(0.0, color="0.7", linewidth=0.5, zorder=0)


def main() -> None:
    """Write one sheet per block."""
    mpl.rcParams["axes.spines.top"] = mpl.rcParams["axes.spines.right"] = False
    effects = catalogue()
    found, equations = signatures(
        rich_measurement(), effects.values(), CABLE, Sensors.BAR_AND_CAPTURE
    )
    places = {equation.place: equation for equation in equations}
    measurement, cable = slack_measurement()
    hidden = [effects[each.effect_id] for each in found if strongest(each) is None]
    shown, elsewhere = signatures(measurement, hidden, cable, Sensors.BAR_AND_CAPTURE)
    slack = {equation.place: equation for equation in elsewhere}
    instead = {each.effect_id: each for each in shown}
    for name, blocks in SHEETS.items():
        own = [each for each in found if effects[each.effect_id].block in blocks]
        rows = -(-len(own) // COLUMNS)
        figure = Figure(figsize=(9.0, 1.9 * rows), layout="constrained")
        FigureCanvasAgg(figure)
        grid = list(figure.subplots(rows, COLUMNS, squeeze=False).flat)
        for axes, signature in zip(grid, own, strict=False):
            other = instead.get(signature.effect_id)
            motion = places if other is None else slack
            draw(axes, effects[signature.effect_id], other or signature, motion)
        for axes in grid[len(own) :]:
            axes.set_axis_off()
        path = FIGURES / f"signatures_{name}.png"
        figure.savefig(path, dpi=100)


if __name__ == "__main__":
    main()
