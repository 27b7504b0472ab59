"""Draw `signatures_*.png`: what each effect adds to its residual along the worst case.

Run `python docs/figures/draw_signatures.py`.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cspm_ident.diagnosis.columns import Place
from cspm_ident.diagnosis.curves import explained_by
from cspm_ident.diagnosis.equation import Equation
from cspm_ident.experiment.isolability import Sensors, Signature, signatures
from cspm_ident.experiment.isolability_page import CABLE, NOISE, rich_measurement
from cspm_msgs_py.dofs import DOFS
from cspm_sim.effects import Block, Effect, catalogue

COLUMNS = 4
POINTS = 900
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


def draw(axes: Axes, effect: Effect, signature: Signature, places: dict[Place, Equation]) -> None:
    """Draw a coefficient of an effect against the signal that explains most of it."""
    axes.set_title(effect.id, fontsize=8)
    axes.tick_params(labelsize=6, length=2)
    where = strongest(signature)
    if where is None:
        axes.text(0.5, 0.5, "not on this motion", ha="center", va="center", fontsize=8)
        axes.set(xticks=[], yticks=[])
        return
    place, channel, coefficient = where
    values = signature.columns[place][:, channel, coefficient]
    equation = places[place]
    names = [n for n in equation.signals if not n.startswith("time")]
    if len(signature.columns[place][0]) > 1:
        names = [n for n in names if DOFS[channel] in n]
    shares = {name: explained_by(equation.signals[name], values) for name in names}
    name = max(shares, key=lambda each: shares[each])
    if shares[name] < 0.3:
        x, name = equation.times, "time [s]"
    else:
        x = equation.signals[name]
    step = max(1, len(values) // POINTS)
    style = "-" if name == "time [s]" else "."
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
    for name, blocks in SHEETS.items():
        own = [each for each in found if effects[each.effect_id].block in blocks]
        rows = -(-len(own) // COLUMNS)
        figure = Figure(figsize=(9.0, 1.9 * rows), layout="constrained")
        FigureCanvasAgg(figure)
        grid = list(figure.subplots(rows, COLUMNS, squeeze=False).flat)
        for axes, signature in zip(grid, own, strict=False):
            draw(axes, effects[signature.effect_id], signature, places)
        for axes in grid[len(own) :]:
            axes.set_axis_off()
        path = Path(__file__).with_name(f"signatures_{name}.png")
        figure.savefig(path, dpi=100)


if __name__ == "__main__":
    main()
