"""What all pictures of runs look like: colours, sizes, fonts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

# Blue, orange and nearly black: colour-blind readers tell them apart, and a grey print too.
COLOURS = ("#0072b2", "#e69f00", "#222222")
# Of many lines: Okabe and Ito, Color universal design, 2008.
PALETTE = (
    *("#0072b2", "#e69f00", "#009e73", "#cc79a7"),
    *("#56b4e9", "#d55e00", "#222222", "#999999"),
)
TENSION = "#555555"
BAND = "#d9ead3"
DPI = 110


@contextmanager
def large_letters() -> Iterator[None]:
    """Draw with letters that are read from two metres: 5 mm high on a sheet, 8 minutes of arc."""
    with mpl.rc_context(
        {
            "font.size": 15.0,
            "axes.titlesize": 17.0,
            "axes.labelsize": 15.0,
            "legend.fontsize": 14.0,
            "axes.spines.top": False,
            "axes.spines.right": False,
        }
    ):
        yield


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, and beside it as SVG, the same bytes for the same figure.

    Args:
        figure: what is drawn.
        path: of the PNG; the SVG has its name, with another ending.

    Raises:
        OSError: a file cannot be written.
    """
    figure.savefig(path, dpi=DPI)
    # Letters stay letters, which are found, copied and set in the reader's type.
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "cspm"}):
        figure.savefig(path.with_suffix(".svg"), metadata={"Date": None})
