"""Draw `frames.png`: frames, angles and signs, on the thesis's geometry.

Run `python docs/scripts/draw_frames.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, FancyArrowPatch
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from cspm_model.kinematics import rotation
from cspm_msgs_py.testbed import Cable, Testbed, load_testbed

Array = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
TESTBED = ROOT / "scenarios" / "testbeds" / "thesis.yaml"
WORLD, FRAME, BAR, CABLE = "#444444", "#1f6fb4", "#c8501e", "#8a8a8a"
FRAME_POSE = np.array([0.95, 0.16, 0.55, 0.0, 0.0, 0.0])
BAR_POSE = np.array([1.08, -0.14, 1.45, 0.0, 0.0, 0.0])
SHOWN = 1  # index of the cable whose vectors are drawn


class View(NamedTuple):
    """A look along one axis of the world.

    Attributes:
        title: above the picture.
        right: index of the axis that points right, and its sign.
        up: index of the axis that points up, and its sign.
        depth: name of the third axis, and whether it points at the reader.
    """

    title: str
    right: tuple[int, int]
    up: tuple[int, int]
    depth: tuple[str, bool]

    def flat(self, points: Array) -> Array:
        """Return points (…, 3) in the picture's plane, shape (…, 2)."""
        return np.stack(
            [self.right[1] * points[..., self.right[0]], self.up[1] * points[..., self.up[0]]],
            axis=-1,
        )


SIDE = View("from starboard: x right, z down, y towards you", (0, 1), (2, -1), ("y", True))
REAR = View("from behind: y right, z down, x away from you", (1, 1), (2, -1), ("x", False))
TOP = View("from above: x up, y right, z away from you", (1, 1), (0, 1), ("z", False))


def exit_points(cables: Sequence[Cable]) -> Array:
    """Return the exit points (n, 3) in world_ned."""
    exits = np.array([cable.exit for cable in cables], dtype=float)
    return np.asarray(FRAME_POSE[:3] + exits @ rotation(FRAME_POSE).T)


def attachment_points(cables: Sequence[Cable]) -> Array:
    """Return the attachment points (n, 3) in world_ned."""
    attachments = np.array([cable.attachment for cable in cables], dtype=float)
    return np.asarray(BAR_POSE[:3] + attachments @ rotation(BAR_POSE).T)


def arrow(axes: Axes, start: Array, end: Array, colour: str, width: float = 1.8) -> None:
    """Draw an arrow between two points of the picture's plane."""
    axes.add_patch(
        FancyArrowPatch(
            (start[0], start[1]),
            (end[0], end[1]),
            arrowstyle="-|>",
            mutation_scale=12,
            color=colour,
            linewidth=width,
            shrinkA=0,
            shrinkB=0,
            zorder=5,
        )
    )


def label(axes: Axes, at: Array, text: str, colour: str, size: float = 10) -> None:
    """Write centred text."""
    written = axes.text(
        at[0], at[1], text, color=colour, fontsize=size, ha="center", va="center", zorder=6
    )
    written.set_path_effects([withStroke(linewidth=3.0, foreground="white")])


def draw_triad(axes: Axes, view: View, origin: Array, colour: str, size: float = 0.26) -> None:
    """Draw a frame's three axes as seen in this view."""
    start = view.flat(origin)
    for name, unit in zip("xyz", np.eye(3), strict=True):
        if name == view.depth[0]:
            continue
        end = view.flat(origin + size * unit)
        arrow(axes, start, end, colour, 2.2)
        vertical = abs(end[0] - start[0]) < 0.5 * size
        across = np.array([0.07, -0.03]) if vertical else np.array([-0.02, 0.075])
        label(axes, end + across, name, colour)
    axes.add_patch(Circle((start[0], start[1]), 0.035, fc="white", ec=colour, lw=1.6, zorder=6))
    mark = "." if view.depth[1] else "x"
    axes.plot(*start, mark, color=colour, ms=6 if mark == "x" else 8, mew=1.6, zorder=7)


def draw_turn(axes: Axes, centre: Array, name: str, clockwise: bool, radius: float = 0.17) -> None:
    """Draw the sense of a positive turn about the axis that the reader looks along."""
    first, last = 25.0, 155.0
    axes.add_patch(
        Arc((centre[0], centre[1]), 2 * radius, 2 * radius, theta1=first, theta2=last, color=BAR)
    )
    tip = np.deg2rad(first if clockwise else last)
    ahead = tip + (-0.35 if clockwise else 0.35)
    arrow(
        axes,
        centre + radius * np.array([np.cos(tip), np.sin(tip)]),
        centre + radius * np.array([np.cos(ahead), np.sin(ahead)]),
        BAR,
        1.0,
    )
    label(axes, centre + np.array([0.0, radius + 0.09]), name, BAR)


def draw_machine(axes: Axes, view: View, testbed: Testbed) -> None:
    """Draw bar, winch frame and cables as seen in this view."""
    exits = view.flat(exit_points(testbed.cables))
    ends = view.flat(attachment_points(testbed.cables))
    for start, end in zip(exits, ends, strict=True):
        axes.plot([start[0], end[0]], [start[1], end[1]], color=CABLE, lw=1.0, zorder=1)
    axes.plot(*exits.T, "o", color=FRAME, ms=4, zorder=4)
    axes.plot(*ends.T, "o", color=BAR, ms=4, zorder=4)
    for body, pose, colour in (
        (testbed.bar, BAR_POSE, BAR),
        (testbed.winch_frame, FRAME_POSE, FRAME),
    ):
        if body is not None and body.dimensions is not None:
            half = 0.5 * np.array(body.dimensions)
            low, high = view.flat(pose[:3] - half), view.flat(pose[:3] + half)
            axes.fill(
                [low[0], high[0], high[0], low[0]],
                [low[1], low[1], high[1], high[1]],
                color=colour,
                alpha=0.15,
                zorder=0,
            )


def draw_view(axes: Axes, view: View, testbed: Testbed) -> None:
    """Draw machine and frames in one view, with equal scales and nothing else."""
    draw_machine(axes, view, testbed)
    draw_triad(axes, view, np.zeros(3), WORLD)
    draw_triad(axes, view, FRAME_POSE[:3], FRAME)
    draw_triad(axes, view, BAR_POSE[:3], BAR)
    axes.set_title(view.title, fontsize=10.5)
    axes.set_aspect("equal")
    axes.axis("off")


def draw_side(axes: Axes, testbed: Testbed) -> None:
    """Draw the view from starboard with the vectors of one cable."""
    draw_view(axes, SIDE, testbed)
    start = SIDE.flat(exit_points(testbed.cables))[SHOWN]
    end = SIDE.flat(attachment_points(testbed.cables))[SHOWN]
    frame, bar = SIDE.flat(FRAME_POSE[:3]), SIDE.flat(BAR_POSE[:3])
    arrow(axes, frame, start, FRAME)
    arrow(axes, bar, end, BAR)
    arrow(axes, start, end, "black", 1.6)
    label(axes, 0.5 * (frame + start) + np.array([0.02, 0.10]), "$a_i$", FRAME, 12)
    label(axes, 0.5 * (bar + end) + np.array([0.02, 0.09]), "$b_i$", BAR, 12)
    label(axes, 0.5 * (start + end) + np.array([-0.09, 0.0]), "$l_i$", "black", 12)
    label(axes, np.array([0.10, 0.19]), "world_ned", WORLD)
    label(axes, frame + np.array([0.88, 0.0]), "winch_frame_ned", FRAME)
    label(axes, bar + np.array([-0.27, -0.13]), "bar_ned", BAR)
    draw_turn(axes, bar + np.array([0.80, -0.08]), "pitch θ", clockwise=False)
    label(axes, bar + np.array([0.36, -0.30]), "surge +x\nheave +z", BAR)
    axes.set_xlim(-0.15, 2.1)
    axes.set_ylim(-1.95, 0.27)


def draw_rear(axes: Axes, testbed: Testbed) -> None:
    """Draw the view from behind."""
    draw_view(axes, REAR, testbed)
    bar = REAR.flat(BAR_POSE[:3])
    draw_turn(axes, bar + np.array([0.75, -0.08]), "roll φ", clockwise=True)
    label(axes, bar + np.array([0.36, -0.22]), "sway +y", BAR)
    axes.set_xlim(-0.95, 1.2)
    axes.set_ylim(-1.95, 0.27)


def draw_top(axes: Axes, testbed: Testbed) -> None:
    """Draw the view from above."""
    draw_view(axes, TOP, testbed)
    draw_turn(axes, np.array([0.92, 0.95]), "yaw ψ", clockwise=True)
    axes.set_xlim(-0.95, 1.2)
    axes.set_ylim(-0.15, 1.8)


def draw_winch(axes: Axes) -> None:
    """Draw a winch with the positive senses of angle, torque, length and tension."""
    axes.add_patch(Circle((0.0, 0.0), 0.35, fc=FRAME, alpha=0.15, ec=FRAME, lw=1.6))
    axes.plot(0.0, 0.0, "o", color=FRAME, ms=4)
    axes.plot([0.35, 0.35], [0.0, -1.35], color="black", lw=1.6)
    axes.add_patch(Arc((0.0, 0.0), 1.0, 1.0, theta1=25, theta2=155, color=FRAME, lw=1.6))
    arrow(axes, np.array([-0.4, 0.30]), np.array([-0.46, 0.19]), FRAME)
    label(axes, np.array([0.0, 0.64]), "angle q, speed q̇, torque τ > 0: winds in", FRAME)
    arrow(axes, np.array([0.0, 0.0]), np.array([-0.3, -0.18]), FRAME, 1.0)
    label(axes, np.array([-0.08, -0.16]), "r", FRAME)
    axes.add_patch(Circle((0.35, -1.38), 0.04, fc=BAR, ec=BAR))
    arrow(axes, np.array([0.35, -1.38]), np.array([0.35, -0.95]), BAR, 2.4)
    axes.text(
        0.50,
        -1.12,
        "tension t ≥ 0 pulls the bar\ntowards the exit:\nw = −Jᵀ t",
        color=BAR,
        fontsize=10,
        va="center",
    )
    axes.text(
        0.50,
        -0.35,
        "unstretched length l0\nshrinks as q grows:\nd(l0)/dt = −(l0/l)(r/n) q̇",
        color="black",
        fontsize=10,
        va="center",
    )
    axes.set_title("a winch", fontsize=10.5)
    axes.set_xlim(-0.9, 1.7)
    axes.set_ylim(-1.6, 0.85)
    axes.set_aspect("equal")
    axes.axis("off")


def main() -> None:
    """Write the picture."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    testbed = load_testbed(TESTBED).testbed
    figure, axes = plt.subplots(2, 2, figsize=(9.6, 9.2))
    draw_side(axes[0, 0], testbed)
    draw_rear(axes[0, 1], testbed)
    draw_top(axes[1, 0], testbed)
    draw_winch(axes[1, 1])
    figure.tight_layout()
    figure.savefig(ROOT / "docs" / "figures" / "frames.png", dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    main()
