"""Claims of the thesis that no command checks, from its two reconstructed machines by this code.

Run `python docs/scripts/thesis_numbers.py`; `docs/results.md` holds its tables, as a test checks.
"""

from __future__ import annotations

import sys
from itertools import combinations
from typing import NamedTuple

import numpy as np
from model_numbers import OPERATING_POINT, TENSION, TESTBED, thesis_laws
from numpy.typing import NDArray

from cspm_control.analysis.cable_groups import cable_groups
from cspm_model.kinematics import geometry
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.dofs import CONTROLLED_AXES
from cspm_msgs_py.testbed import Testbed, load_testbed

Array = NDArray[np.float64]

REFITTED = TESTBED.with_name("thesis_refitted.yaml")
# A set of cables whose directions give one force or moment less has no inverse; the next smallest
# singular value of the others is a hundred times this share of the largest.
SINGULAR = 1e-9


class Sets(NamedTuple):
    """How many sets of five cables there are, and what they can do at the operating point.

    Attributes:
        total: of all sets.
        regular: of sets that give the five controlled directions.
        pulling: of those, sets that hold the weight without pushing.
        within: of those, sets that do so below the highest tensions.
        largest: highest tension of any pulling set by kind of cable [N].
        limits: highest tension allowed by kind of cable [N].
    """

    total: int
    regular: int
    pulling: int
    within: int
    largest: dict[str, float]
    limits: dict[str, float]


def five_cables(testbed: Testbed) -> Sets:
    """Return what five cables alone can do: "any 5 cables" of the thesis's conclusions."""
    assert testbed.bar is not None
    axes = list(CONTROLLED_AXES)
    cables = nominal_parameters(testbed).cables
    pull = -geometry(cables, np.array(OPERATING_POINT), np.zeros(6)).bar.T[axes]
    weight = np.zeros(len(axes))
    weight[2] = -testbed.bar.mass * testbed.gravity
    most = np.array([cable.tension_limits for cable in testbed.cables], dtype=float)[:, 1]
    sets = [list(each) for each in combinations(range(len(most)), len(axes))]
    tensions = np.full((len(sets), len(most)), np.nan)
    for row, members in zip(tensions, sets, strict=True):
        singular = np.linalg.svd(pull[:, members], compute_uv=False)
        if singular[-1] > SINGULAR * singular[0]:
            row[members] = np.linalg.solve(pull[:, members], weight)
    regular = tensions[np.isfinite(tensions).any(axis=1)]
    pulling = regular[np.nanmin(regular, axis=1) >= -1e-9]
    groups = cable_groups(testbed.cable_names)
    return Sets(
        len(sets),
        len(regular),
        len(pulling),
        int((np.nan_to_num(pulling) <= most).all(axis=1).sum()),
        {name: float(np.nanmax(pulling[:, i])) for name, i in groups.items()},
        {name: float(most[i].max()) for name, i in groups.items()},
    )


def set_lines() -> list[str]:
    """Return the table of what five cables alone can do."""
    found = five_cables(load_testbed(TESTBED).testbed)
    rows = [
        ("sets of five cables", f"{found.total}"),
        ("that give all five directions", f"{found.regular}"),
        ("that hold the weight, each cable pulling", f"{found.pulling}"),
        ("of these below the highest tensions", f"{found.within}"),
    ]
    rows += [
        (f"highest tension, {name}", f"{found.largest[name]:.1f} of {found.limits[name]:g} N")
        for name in found.largest
    ]
    return ["| at [0, 0, 2, 0, 0, 0] | |", "|---|---|", *(f"| {a} | {b} |" for a, b in rows)]


def thickness_lines() -> list[str]:
    """Return the table of cables beside what the thesis says of their thickness."""
    lines = ["| machine | quantity | hoist | surge | sway |", "|---|---|---|---|---|"]
    for file in (TESTBED, REFITTED):
        laws = thesis_laws(file).values()
        diameters = [1e3 * law.law.diameter for law in laws]
        quantities = {
            "diameter, mm": [f"{each:.3f}" for each in diameters],
            "dt/dε at 5 N, N/m": [f"{float(law.stiffness(TENSION)):.0f}" for law in laws],
            "cap E·A/l met at, N": [f"{law.cap_tension():.1f}" for law in laws],
            "highest tension, N": [f"{law.tension_limit:g}" for law in laws],
        }
        lines += [f"| `{file.stem}` | {name} | {' | '.join(v)} |" for name, v in quantities.items()]
    return lines


def report() -> str:
    """Return all tables, under the names by which the pages mark them."""
    parts = {"sets": set_lines(), "thickness": thickness_lines()}
    return "".join(
        f"<!-- numbers: {name} -->\n" + "\n".join(lines) + "\n<!-- end -->\n\n"
        for name, lines in parts.items()
    )


if __name__ == "__main__":
    sys.stdout.write(report())
