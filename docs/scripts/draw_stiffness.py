"""Draw `stiffness.png`: tension against elongation in both readings of the stiffness law.

Run `python docs/scripts/draw_stiffness.py`.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from model_numbers import Law, thesis_laws
from scipy.integrate import solve_ivp

from cspm_model.stiffness import law_slope

COLOURS = {"tangent": "#1f6fb4", "no cap": "#7fb2de", "secant": "#c8501e", "cap": "#8a8a8a"}


def draw_law(axes: Axes, law: Law, name: str) -> None:
    """Draw one cable class."""
    top = law.tension_limit
    tension = np.linspace(1e-6, top, 2000)
    stretch = np.linspace(0.0, law.tangent_elongation(top, law.law.floor_tension), 1500)
    curves = {
        "tangent, floor, cap: used": (stretch, _integrate(law, stretch, law.cap), "tangent", "-"),
        "tangent, floor, no cap": (stretch, _integrate(law, stretch, np.inf), "no cap", "--"),
        "secant": (tension / law.stiffness(tension), tension, "secant", "-"),
    }
    for title, (x, y, colour, style) in curves.items():
        axes.plot(1e3 * x, y, style, color=COLOURS[colour], label=title, zorder=3)
    axes.plot(
        [0.0, 1e3 * top / law.cap], [0.0, top], ":", color=COLOURS["cap"], label="slope of the cap"
    )
    axes.set(xlabel="elongation ε, mm", ylim=(0.0, top), xlim=(0.0, None))
    axes.set_title(f"{name}, l = {law.elastic_length:.3f} m", fontsize=10)
    axes.grid(alpha=0.3)


def _integrate(law: Law, stretch: np.ndarray, cap: float) -> np.ndarray:
    solution = solve_ivp(
        lambda _, t: np.minimum(law.scale * law_slope(law.law, t), cap),
        (0.0, stretch[-1]),
        [0.0],
        t_eval=stretch,
        rtol=1e-9,
        atol=1e-9,
    )
    return np.asarray(solution.y[0])


def main() -> None:
    """Write the picture."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.8))
    for ax, (name, law) in zip(axes, thesis_laws().items(), strict=True):
        draw_law(ax, law, name)
    axes[0].set_ylabel("tension t, N")
    figure.legend(*axes[0].get_legend_handles_labels(), ncols=4, fontsize=9, loc="lower center")
    figure.tight_layout(rect=(0.0, 0.07, 1.0, 1.0))
    path = Path(__file__).resolve().parents[1] / "figures" / "stiffness.png"
    figure.savefig(path, dpi=90, metadata={"Software": None})


if __name__ == "__main__":
    main()
