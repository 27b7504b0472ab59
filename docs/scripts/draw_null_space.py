"""Draw `null_space.png`: the thesis's figure 5-2, tensions of one pose as each λ of (5-7) is swept.

Run `python docs/scripts/draw_null_space.py`.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from cspm_control.allocation.tension_distribution import TensionDistribution
from cspm_model.kernels.rows import pose_row
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.control_spec.distribution import TensionDistribution as HowDistributed
from cspm_msgs_py.scenario import DESIGN_POSE
from cspm_msgs_py.testbed import Testbed, load_testbed

ROOT = Path(__file__).resolve().parents[2]
THESIS_LAMBDA = (6.0, 0.0, 2.0)
COLOURS = {"hoist": "#1f6fb4", "surge": "#c8501e", "sway": "#3a8f4d"}


def tensions(testbed: Testbed, coordinates: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the tensions (n,) [N] that hold the bar at the operating point, without limits."""
    how = HowDistributed(method="prescribed", null_space=coordinates)
    limits = np.tile([-np.inf, np.inf], (len(testbed.cables), 1))
    solver = TensionDistribution(nominal_parameters(testbed).cables, limits, how)
    bar, frame = np.empty(7), np.empty(7)
    pose_row(np.array(DESIGN_POSE), bar)
    pose_row(np.zeros(6), frame)
    assert testbed.bar is not None
    wrench = np.array([0.0, 0.0, -testbed.bar.mass * testbed.gravity, 0.0, 0.0, 0.0])
    return solver.step(wrench, bar, frame).tensions


def main() -> None:
    """Write the picture."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    testbed = load_testbed(ROOT / "scenarios" / "testbeds" / "thesis.yaml").testbed
    names, sweep = testbed.cable_names, np.linspace(-10.0, 10.0, 41)
    figure, (bars, *axes) = plt.subplots(1, 4, figsize=(12.0, 3.6), sharey=True)
    for shift, coordinates, shade in ((-0.2, (0.0, 0.0, 0.0), 0.45), (0.2, THESIS_LAMBDA, 1.0)):
        place, label = np.arange(len(names)) + shift, f"λ = {[round(x) for x in coordinates]}"
        bars.bar(place, tensions(testbed, coordinates), 0.4, color="k", alpha=shade, label=label)
    bars.set_xticks(range(len(names)), names, rotation=60, fontsize=8)
    bars.set(ylabel="tension, N")
    bars.legend(fontsize=8)
    for j, ax in enumerate(axes):
        swept = [tensions(testbed, tuple(x * np.eye(3)[j])) for x in sweep]
        for name, values in zip(names, np.transpose(swept), strict=True):
            kind, _, number = name.partition("_")
            style = ("-", "--", "-.", ":")[int(number) - 1]
            ax.plot(sweep, values, style, color=COLOURS[kind], label=name)
        ax.axhline(2.0, color="#8a8a8a", lw=0.8)
        ax.set(xlabel=f"λ{'₁₂₃'[j]}, N, the others 0")
        ax.grid(alpha=0.3)
    axes[-1].legend(fontsize=7, ncols=2)
    figure.tight_layout()
    path = ROOT / "docs" / "figures" / "null_space.png"
    figure.savefig(path, dpi=90, metadata={"Software": None})


if __name__ == "__main__":
    main()
