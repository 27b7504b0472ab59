"""Panels of the figures of runs: errors in the requirement's band, envelopes, peaks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from cspm.plots.picture_style import BAND, COLOURS, TENSION
from cspm_msgs_py.dofs import DOFS
from cspm_run.run_statistics import RunStatistics

Array = NDArray[np.float64]

# Share of the height that a label of large letters takes.
_ROOM = 0.2


def draw_errors(
    axes: Axes, time: Array, bands: Array, axes_of: Sequence[int], limit: float
) -> None:
    """Draw envelopes of errors in the requirement's band, the greatest labelled.

    Args:
        axes: where to.
        time: of the bins, shape (n,) [s].
        bands: lowest and highest value per bin, shape (n, 2, 6 or more).
        axes_of: the degrees of freedom to draw.
        limit: the requirement, in the unit of the bands [mm or mrad].
    """
    unit = "mm" if axes_of[0] < 3 else "mrad"
    axes.axhspan(-limit, limit, color=BAND, label=f"required ± {limit:g} {unit}")
    worst = max(axes_of, key=lambda d: float(np.abs(bands[:, :, d]).max(initial=0.0)))
    for i, d in enumerate(axes_of):
        draw_envelope(axes, time, bands[:, 0, d], bands[:, 1, d], COLOURS[i], DOFS[d])
    if len(time):
        _mark_peak(axes, time, bands[:, :, worst], DOFS[worst])


def _mark_peak(axes: Axes, time: Array, band: Array, name: str) -> None:
    """Label the greatest value: beyond the lines where there is room, else beside its peak."""
    place, side = np.unravel_index(int(np.abs(band).argmax()), band.shape)
    height, late = float(band[place, side]), place > len(time) // 2
    least, most = axes.get_ylim()
    roomy = least + _ROOM * (most - least) < height < most - _ROOM * (most - least)
    above = (height > 0.0) is roomy
    axes.annotate(
        f"{name} {abs(height):.3g}",
        (float(time[place]), height),
        xytext=(-6 if late else 6, 4 if above else -4),
        textcoords="offset points",
        ha="right" if late else "left",
        va="bottom" if above else "top",
        fontsize="large",
    )


def binned(statistics: RunStatistics, period: float) -> tuple[Array, Array]:
    """Return when the bins of a run begin, shape (n,) [s], and its envelope, shape (n, 2, 6 + m).

    Args:
        statistics: of the run, with errors [m, rad] and m tensions [N].
        period: the plant's period [s].
    """
    used = -(-statistics.steps // statistics.bin_steps)
    time = np.arange(used, dtype=np.float64) * (statistics.bin_steps * period)
    return time, statistics.envelope[:used]


def draw_tensions(
    axes: Axes, time: Array, envelope: Array, members: Sequence[int]
) -> tuple[Array, Array]:
    """Draw the envelope of some cables' tensions; return it, lowest and highest, (n,) each [N].

    Args:
        axes: where to.
        time: of the bins, shape (n,) [s].
        envelope: of a run, as `binned` returns it.
        members: indices of the cables.
    """
    columns = envelope[:, :, [6 + member for member in members]]
    low, high = columns[:, 0].min(axis=1), columns[:, 1].max(axis=1)
    draw_envelope(axes, time, low, high, TENSION, "")
    return low, high


def draw_envelope(axes: Axes, time: Array, low: Array, high: Array, colour: str, name: str) -> None:
    """Draw one envelope over time, shape (n,) each, so that no spike is lost."""
    axes.fill_between(time, low, high, color=colour, label=name, alpha=0.75, linewidth=0.8)
    axes.grid(alpha=0.3)
    axes.margins(x=0)
