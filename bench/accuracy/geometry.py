"""What `cspm identify system` finds of a machine whose cables begin and end elsewhere.

`python -m bench.accuracy.geometry` records scenario factor_six_mid on the MuJoCo plant twice, once
with all exits moved together and once with the ends of two cables moved, identifies them, and
writes the tables of results/identification.md.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from rich.console import Console
from scipy.spatial.transform import Rotation

from bench.accuracy.recovery import PAGE, TESTBED, found_table, record
from bench.page import into_page
from cspm_ident.signals.measurement import Measurement
from cspm_ident.system.choice import choose
from cspm_ident.system.identification import identify_system
from cspm_ident.system.machine import machine_with
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed import Testbed, load_testbed

# Where the frame is beside where its sensor says: x y z [m], φ θ ψ [rad].
FRAME = (0.008, -0.006, 0.01, 0.004, -0.005, 0.006)
# The mass of the machine that is moved as a whole [kg]; the described one has 4.06.
MASS = 4.35
# By how much single coordinates are elsewhere [m].
POINTS = {
    "exit.sway_1.x": 0.008,
    "exit.sway_1.y": -0.006,
    "exit.sway_1.z": 0.01,
    "attachment.hoist_2.x": 0.006,
    "attachment.hoist_2.z": -0.008,
}
WINDOWS = 4


def main() -> None:
    """Run the whole."""
    console = Console()
    described = load_testbed(TESTBED)
    machine = described.testbed
    mass = choose(machine, ["bar.mass"])
    moved = machine_with(with_frame_beside(machine, FRAME), mass, [MASS])
    truth = {"bar.mass": MASS, **{f"frame_offset.{d}": v for d, v in zip(DOFS, FRAME, strict=True)}}
    into_page(PAGE, "frame", _found(record(described, moved), truth, console))
    chosen = choose(machine, list(POINTS))
    truth = {each.name: each.nominal + POINTS[each.name] for each in chosen}
    moved = machine_with(machine, chosen, list(truth.values()))
    into_page(PAGE, "points", _found(record(described, moved), truth, console))


def with_frame_beside(machine: Testbed, offset: tuple[float, ...]) -> Testbed:
    """Return the machine with all exits moved as one body by x y z [m], φ θ ψ [rad]."""
    turn = Rotation.from_euler("ZYX", offset[:2:-1])
    cables = [
        cable.model_copy(
            update={"exit": tuple((np.array(offset[:3]) + turn.apply(cable.exit)).tolist())}
        )
        for cable in machine.cables
    ]
    return machine.model_copy(update={"cables": tuple(cables)})


def _found(measurement: Measurement, truth: Mapping[str, float], console: Console) -> str:
    chosen = choose(measurement.machine, list(truth))
    result = identify_system([measurement], chosen, most_windows=WINDOWS, progress=console.print)
    if not result.settled:
        console.print("values and initial states did not settle")
    text = found_table(result, truth)
    console.print(text, markup=False, highlight=False)
    return text


if __name__ == "__main__":
    main()
