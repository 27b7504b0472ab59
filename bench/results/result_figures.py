"""The pictures of results/steep-sea.md."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from cspm_msgs_py.dofs import DOFS

Array = NDArray[np.float64]

TRANSLATIONS, ANGLES = (0, 1, 2), (4, 5)
SHOWN_S = (0.0, 60.0)
_DPI = 110
_COLOURS = 96


def draw_comparison(path: Path, found: Mapping[str, Mapping[str, Any]]) -> None:
    """Draw errors of controlled coordinates and the least tension, a column per controller."""
    figure = Figure(figsize=(11, 8), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(3, len(found), sharex=True, sharey="row", squeeze=False)
    for column, (name, each) in enumerate(found.items()):
        low, high = np.array(each["low"]), np.array(each["high"])
        for row, (dofs, limit) in enumerate(((TRANSLATIONS, 2.0), (ANGLES, 4.0))):
            for d in dofs:
                axes[row][column].fill_between(
                    each["times"], low[:, d], high[:, d], label=DOFS[d], alpha=0.8, linewidth=1.0
                )
            for side in (-limit, limit):
                axes[row][column].axhline(side, color="black", linestyle="--", linewidth=0.8)
            # Linear within the requirement, so that both controllers can be seen.
            axes[row][column].set_yscale("symlog", linthresh=limit)
            ticks = [-100.0, -10.0, -limit, 0.0, limit, 10.0, 100.0]
            axes[row][column].set_yticks(ticks, [f"{tick:g}" for tick in ticks])
            axes[row][column].legend(loc="upper right", ncols=3, fontsize="small")
        axes[2][column].plot(each["times"], each["least"], linewidth=0.8)
        axes[0][column].set_title(name)
        axes[2][column].set_xlabel("time [s]")
    for row, label in enumerate(("error [mm]", "error [mrad]", "least tension [N]")):
        axes[row][0].set_ylabel(label)
        for each_axes in axes[row]:
            each_axes.grid(alpha=0.3)
            each_axes.margins(x=0)
    _save(figure, path)


def draw_limit(path: Path, least: Array, period: float, past: Mapping[str, Any]) -> None:
    """Draw the highest lower limit that allows the reference [N], and the error beside it."""
    figure = Figure(figsize=(11, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    top, bottom = figure.subplots(2, 1, sharex=True)
    times = period * np.arange(len(least))
    top.plot(times, least, linewidth=0.9, color="tab:blue")
    for limit, colour in ((0.0, "tab:red"), (0.3, "tab:orange"), (2.0, "black")):
        label = f"{limit:g} N: met {(least >= limit).mean():.1%} of the time"
        top.axhline(limit, color=colour, linestyle="--", linewidth=0.9, label=label)
    top.set_ylabel("highest possible\nleast tension [N]")
    top.legend(loc="upper right", fontsize="small")
    low, high = np.array(past["low"]), np.array(past["high"])
    for d in TRANSLATIONS:
        bottom.fill_between(past["times"], low[:, d], high[:, d], label=DOFS[d], linewidth=1.0)
    edge = np.where(least < 0.3, 1.0, 0.0)
    bottom.fill_between(
        times,
        0,
        edge,
        step="mid",
        transform=bottom.get_xaxis_transform(),
        color="tab:orange",
        alpha=0.3,
        label="no tensions ≥ 0.3 N exist",
    )
    bottom.set_ylabel("error [mm]")
    bottom.set_xlabel("time [s]")
    bottom.legend(loc="upper right", ncols=4, fontsize="small")
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
        axes.set_xlim(*SHOWN_S)
    _save(figure, path)


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=_DPI)
    # Few colours: a quarter of the size.
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(_COLOURS, dither=Image.Dither.NONE)
    small.save(path, optimize=True)
