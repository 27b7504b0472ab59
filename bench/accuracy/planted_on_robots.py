"""What a diagnosis says of physics planted in each of the six robots: `results/robots.md`.

`python -m bench.accuracy.planted_on_robots [FILE]` plants Coulomb friction of 1 % of the torque
limit, a stiffness of 0.8 and a drum radius 2 % too large in one winch or cable of each robot, one
at a time, and diagnoses each recording beside the robot's own file. Recordings come from the
plant whose equations the catalogue shares: they show that the method is not tied to one machine.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import cspm
from bench.markdown import markdown_table
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_run.library import named_testbed

ROBOTS = {
    "planar_kntu": "upper_left",
    "stadium_camera": "north_east",
    "suspended_four": "front_left",
    "robocrane": "c1",
    "ipanema": "c3",
    "cogiro": "c3",
}
PAGE = Path("results/robots.md")


class Planted(NamedTuple):
    """One recording: robot, cable, effect, its parameter and value."""

    robot: str
    cable: str
    effect: str
    parameter: str
    value: float


def planted() -> Iterator[Planted]:
    """Yield what is planted where."""
    for robot, name in ROBOTS.items():
        (cable,) = (c for c in named_testbed(robot).testbed.cables if c.name == name)
        yield Planted(robot, name, "winch_coulomb_friction", "torque", 0.01 * cable.torque_limit)
        yield Planted(robot, name, "cable_stiffness", "scale", 0.8)
        yield Planted(robot, name, "winch_drum_radius", "radius", 1.02 * cable.drum_radius)


def diagnosed(case: Planted, folder: Path) -> tuple[str, ...]:
    """Return a row: robot, effect, planted, verdict, found with its interval."""
    worn = cspm.load_testbed(case.robot)
    worn = worn.with_effect(case.effect, case.cable, **{case.parameter: case.value})
    recording = cspm.simulate(case.robot, testbed=worn).save(folder / f"{case.robot}_{case.effect}")
    found = cspm.diagnose(recording, testbed=case.robot, closed_loop=False)
    said = []
    for each in found.findings:
        right = (each.effect, each.elements) == (case.effect, (case.cable,))
        number = each.parameters.get(case.parameter)
        if right and number is not None and number.ci95:
            low, high = number.ci95
            mark = "" if low <= case.value <= high else " ✗"
            said.append(f"{number.value:.4g} ({low:.4g} to {high:.4g}){mark}")
        else:
            said.append(f"{each.effect} on {', '.join(each.elements)} ✗")
    place = f"{case.effect} on {case.cable}"
    return case.robot, place, f"{case.value:.4g}", found.verdict, "; ".join(said) or "nothing ✗"


def main() -> None:
    """Plant, simulate, diagnose, and write the page."""
    page = Path(sys.argv[1]) if len(sys.argv) > 1 else PAGE
    with ScratchFolder("planted-on-robots") as folder:
        rows = []
        for case in planted():
            rows.append(diagnosed(case, folder))
            print(*rows[-1], sep=" | ", flush=True)
    heads = ("robot", "planted", "value", "verdict", "found, 95 % interval")
    right = sum("✗" not in row[-1] for row in rows)
    text = (
        "# Physics planted in six robots\n\nMade by `python -m bench.accuracy.planted_on_robots`."
        f" Found with the planted value in the interval, and nothing beside it: {right} of"
        f" {len(rows)}.\n\n{markdown_table(heads, rows)}\n"
    )
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
