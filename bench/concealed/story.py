"""One real case as a picture: measured torque, the model without a term, and with what was named.

python -m bench.concealed.story DIR --case kuka_6-deletion-winch_viscous_friction --out FILE.png
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.blind.scoring.method import CSPM, Methods
from bench.concealed.case import DELETION, Case, conceal, signals_of
from bench.concealed.machine import INERTIA, Machine, machines
from bench.concealed.spike import TORQUES, Motion, motion_of

Array = NDArray[np.float64]


class Story(NamedTuple):
    """The held-out recording of a case.

    Attributes:
        case: what was deleted.
        named: the finding.
        motion: as recorded.
        before, after: torque of the file as it is, and with what was named [N·m].
        rate: of rows [Hz].
    """

    case: Case
    named: dict[str, Any]
    motion: Motion
    before: Array
    after: Array
    rate: float

    def left(self, model: Array) -> float:
        """Return the RMS torque that a model leaves while the shaft moves [N·m]."""
        return self.motion.rms(self.motion.torque - model)


def story_of(case: Case, place: Path) -> Story:
    """Diagnose a deletion, and let both models say the held-out recording's torque.

    Raises:
        ValueError: it is not named.
    """
    with tempfile.TemporaryDirectory() as room:
        searched, held_out = conceal(case, place, Path(room))
        found, _ = Methods(searched, held_out).diagnosis_by(CSPM)
    named = next((f for f in found["findings"] if f["effect"] == case.effect), None)
    if named is None:
        raise ValueError(f"{case.name}: not named, verdict {found['verdict']}")
    machine = case.machine
    motion = motion_of(machine, signals_of(machine, place / machine.dataset.held_out[0]))
    before = _file_torque(case, motion)
    name, column = TORQUES[case.effect]
    (value,) = (p["value"] for p in named["parameters"] if p["name"] == name)
    after = before + value * column(machine, motion)
    return Story(case, named, motion, before, after, machine.rate)


def _file_torque(case: Case, motion: Motion) -> Array:
    machine: Machine = case.machine
    inertia = (0.5 if case.effect == INERTIA else 1.0) * machine.inertia
    torque = inertia * motion.acceleration
    for effect, parameters in machine.terms.items():
        name, column = TORQUES[effect]
        if effect != case.effect:
            torque = torque + parameters[name] * column(machine, motion)
    return torque


def draw_story(path: Path, story: Story) -> None:
    """Draw measured and modelled torque, before and after."""
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    time = np.arange(len(story.motion.torque)) / story.rate
    titles = ("the file lacks a term", "with what was named")
    for axes, model, title in zip((upper, lower), (story.before, story.after), titles, strict=True):
        axes.plot(time, story.motion.torque, color="0.6", linewidth=1.0, label="measured")
        # At rest friction has no sign.
        shown = np.where(story.motion.moving, model, np.nan)
        axes.plot(time, shown, color="C3" if axes is upper else "C0", linewidth=1.2, label="model")
        axes.set_title(f"{title}: {story.left(model):.2f} N·m RMS unexplained")
        axes.set_ylabel("torque [N·m]")
        axes.legend(loc="upper right")
    lower.set_xlabel("time of the held-out recording [s]")
    FigureCanvasAgg(figure).print_figure(path, dpi=100)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m bench.concealed.story", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR")
    parser.add_argument("--case", required=True, metavar="NAME", help="a deletion")
    parser.add_argument("--out", required=True, type=Path, metavar="FILE", help="PNG")
    given = parser.parse_args()
    name, _, effect = given.case.partition(f"-{DELETION}-")
    (machine,) = (each for each in machines() if each.name == name)
    place = machine.dataset.place(given.folders)
    assert place is not None, f"{machine.dataset.folder}: not below what is given"
    story = story_of(Case(machine, DELETION, effect), place)
    draw_story(given.out, story)
    (number, *_) = story.named["parameters"]
    low, high = number["ci95"]
    print(
        f"{effect}: {number['name']} {number['value']:.4g} ({low:.4g} to {high:.4g}), true"
        f" {machine.deletions[effect]}; unexplained {story.left(story.before):.3g} before,"
        f" {story.left(story.after):.3g} N·m after"
    )


if __name__ == "__main__":
    main()
