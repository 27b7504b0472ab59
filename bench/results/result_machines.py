"""What results/steep-sea.md says of the machines: worked out whenever it is written."""

from __future__ import annotations

from itertools import count

from bench.markdown import markdown_table
from bench.results.result_cases import FASTEST_CROSSOVER, PAST, SIX
from bench.results.result_tables import Found
from bench.results.tracking import Case
from cspm_control.analysis.cable_structure import cable_structure
from cspm_control.analysis.manipulability import manipulability
from cspm_control.design.gains import design_motion_gains
from cspm_model.parameters import nominal_parameters
from cspm_msgs_py.dofs import Dof
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

# Fast enough for the bandwidth that the thesis requires, and slow enough for its margins [rad/s].
SLOWEST = 8
# How far below the frame the bars hang where controllers are designed, and where the thesis's
# loop goes unstable [m].
DESIGNED, DEEPEST = 2.0, 4.0


def conditions_block(_: Found) -> str:
    """Return rank and condition numbers of both machines where their controllers are designed."""
    rows = []
    for scenario in (PAST, SIX):
        testbed, pose = _testbed(scenario), _pose(DESIGNED)
        found = manipulability(cable_structure(testbed, pose), nominal_parameters(testbed), pose)
        numbers = f"{found.condition:.1f}", f"{found.scaled_condition:.1f}"
        rows.append([f"`{testbed.name}`", str(found.rank), *numbers])
    return markdown_table(
        ["test-bed", "rank of Jᵀ", "κ", "κ, moments over the radius of gyration"], rows
    )


def fastest_block(_: Found) -> str:
    """Return the fastest motion loops that the thesis's margins allow, and those that are taken."""
    testbed = _testbed(PAST)
    rows = [
        [
            f"allowed, z = {height:g} m",
            *(str(fastest_crossover(testbed, _pose(height), dof)) for dof in FASTEST_CROSSOVER),
        ]
        for height in (DESIGNED, DEEPEST)
    ]
    rows.append(["taken below", *map(str, FASTEST_CROSSOVER.values())])
    return markdown_table(["crossover [rad/s]", *FASTEST_CROSSOVER], rows)


def fastest_crossover(testbed: Testbed, pose: tuple[float, ...], dof: Dof) -> int:
    """Return the highest crossover in whole rad/s that can be designed, from `SLOWEST` on.

    Raises:
        InputError: not even that can be.
    """
    parameters = nominal_parameters(testbed)
    design_motion_gains(testbed, parameters, pose, {dof: SLOWEST})
    for faster in count(SLOWEST + 1):
        try:
            design_motion_gains(testbed, parameters, pose, {dof: faster})
        except InputError:
            break
    return faster - 1


def _testbed(scenario: str) -> Testbed:
    return Case(scenario).bundle().testbed.testbed


def _pose(height: float) -> tuple[float, ...]:
    return (0.0, 0.0, height, 0.0, 0.0, 0.0)
