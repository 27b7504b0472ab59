"""How far the two plants differ, and the page that shows it.

Run `python -m cspm_run.agreement > results/agreement.md` after a change in either plant.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.recording.run_record import MUJOCO, SIM
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.assembly import assemble, resolve
from cspm_run.bundle import make_bundle
from cspm_run.library import find_scenario
from cspm_run.loop import Loop

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AgreementCase:
    """One comparison.

    Attributes:
        scenario: of the library.
        note: what is unlike the scenario, for the table.
        overrides: as `cspm run --set` takes them, for both.
        finer: how many steps ours makes in one of MuJoCo's.
    """

    scenario: str
    note: str = ""
    overrides: tuple[str, ...] = ()
    finer: int = 1


MINUTE = "duration=60"
IDEAL = "sensors=ideal"
CASES = (
    AgreementCase("calm_broadband", "", (MINUTE,)),
    AgreementCase("worst_case_steep", "", (MINUTE,)),
    AgreementCase("calm_broadband", "ideal sensors", (MINUTE, IDEAL)),
    AgreementCase("worst_case_steep", "ideal sensors", (MINUTE, IDEAL)),
    AgreementCase("worst_case_steep", "ideal sensors, ours at 0.25 ms", (MINUTE, IDEAL), finer=4),
    AgreementCase("verification_short"),
    AgreementCase("verification_mid"),
    AgreementCase("verification_long"),
)


@dataclass(frozen=True)
class Trace:
    """The true states of a run, step by step.

    Attributes:
        poses: x y z φ θ ψ of the bar, (steps, 6) [m, rad].
        tensions: (steps, n) [N].
        real_time_factor: simulated over elapsed time of everything but recording.
    """

    poses: Array
    tensions: Array
    real_time_factor: float


@dataclass(frozen=True)
class Agreement:
    """RMS differences between two runs of one scenario.

    Attributes:
        pose: per coordinate, (6,) [m, rad].
        motion: RMS of the pose about its mean, (6,), to compare with.
        tension: over all cables [N].
        tension_peak: the largest of all [N].
        real_time_factors: of ours and of MuJoCo's.
    """

    pose: Array
    motion: Array
    tension: float
    tension_peak: float
    real_time_factors: tuple[float, float]


def trace(scenario: str, overrides: Sequence[str], plant: str) -> Trace:
    """Run a scenario of the library on a plant and keep the true states."""
    path = find_scenario(scenario)
    loaded = load_scenario(path, overrides)
    testbed = load_testbed(path.parent / loaded.testbed)
    resolved = resolve(loaded, testbed.testbed, path.parent)
    bundle = make_bundle(resolved, testbed, path.parent)
    with bundle.unpacked() as place:
        parts = assemble(bundle.scenario, testbed.testbed, place, plant)
    loop = Loop(parts, {}, lambda _now, _status: None)
    steps = round(loaded.duration * loaded.rates.plant)
    poses, tensions = np.zeros((steps, 6)), np.zeros((steps, len(testbed.testbed.cables)))
    began = time.perf_counter()
    for k in range(steps):
        poses[k], tensions[k] = parts.plant.bar_state[:6], parts.plant.tensions
        loop.step()
        if k == 0:  # the first step compiles
            began = time.perf_counter()
    elapsed = time.perf_counter() - began
    return Trace(poses, tensions, loaded.duration / elapsed)


def compare(case: AgreementCase) -> Agreement:
    """Run a case on both plants."""
    finer = (*case.overrides, f"rates.plant={1000 * case.finer}")
    ours = trace(case.scenario, finer, SIM)
    theirs = trace(case.scenario, case.overrides, MUJOCO)
    pose = theirs.poses - ours.poses[:: case.finer]
    tension = theirs.tensions - ours.tensions[:: case.finer]
    return Agreement(
        pose=np.sqrt(np.mean(pose**2, axis=0)),
        motion=ours.poses.std(axis=0),
        tension=float(np.sqrt(np.mean(tension**2))),
        tension_peak=float(np.abs(tension).max()),
        real_time_factors=(ours.real_time_factor, theirs.real_time_factor),
    )


_HEAD = """\
# Agreement of the two plants

`cspm run --plant mujoco` simulates the same test-bed a second time, with other code. MuJoCo holds
bar (as a quaternion), rotors and unstretched lengths and integrates them; the cable law is found
from its integral at every call; friction of the winches is MuJoCo's own. The two plants share
test-bed files, prescribed motions, sensors and controllers, and not one line of the equations
(`tests/cspm_sim/mujoco/test_mujoco_independence.py`).

The table has the RMS of *MuJoCo − ours* over all steps of 1 ms, of true values, from the same seed:
surge, sway and heave in m, angles in rad, tension over all cables in N, and the largest difference
of any tension. Below is the RMS of the motion itself about its mean.

This page is generated: `python -m cspm_run.agreement > results/agreement.md`.
"""

_CAUSES = """
## Why they differ

- **Rounding of the sensors** makes all of the difference in the first two comparisons. The load
  cells round to 5 mN. A difference of 10⁻⁹ N now and then takes a measured tension to the next
  step, the force controller answers, and the two runs go on apart, as far as the loops let them.
  With ideal sensors the difference is more than ten thousand times smaller, and likewise with
  noise and no rounding (`tests/cspm_sim/mujoco/test_mujoco_run.py`).
- **The table of the cable law.** Ours reads tension from a table that is within 10⁻⁹ N of the
  integral; MuJoCo's plant evaluates the integral. This remains with locked winches.
- **The integration.** Both use the classical Runge-Kutta scheme, ours on Euler angles, MuJoCo's on
  a quaternion. At equal steps most of its error is common to both and does not show; the line with
  ours at 0.25 ms shows it. It falls with the fourth power of the step
  (`tests/cspm_sim/mujoco/test_mujoco_plant.py`).
- **Dry friction** is not in the table, since the thesis's machine has none. Ours stops a shaft
  within one step; MuJoCo's is a constraint that creeps, slower than 10⁻⁴ rad/s. Instants of
  sticking differ by a few steps.

## Limits of the MuJoCo plant

- Effects: `bar_linear_damping`, `cable_transverse_damping`, `winch_viscous_friction`,
  `winch_coulomb_friction`. Others are refused.
- MuJoCo calls back into the process at each stage of a step, and a process has one such callback:
  only one thread may step such plants.
- It needs `pip install 'cspm[mujoco]'`.
"""


def agreement_page(found: Sequence[tuple[AgreementCase, Agreement]]) -> str:
    """Return the page in Markdown."""
    columns = [*DOFS, "tension", "largest"]
    lines = [
        f"{_HEAD}\nMuJoCo {version('mujoco')}.\n",
        "| scenario | " + " | ".join(columns) + " |",
        "|---" * (1 + len(columns)) + "|",
    ]
    for case, agreement in found:
        name = f"`{case.scenario}`" + f", {case.note}" * bool(case.note)
        numbers = [*agreement.pose, agreement.tension, agreement.tension_peak]
        lines.append(_row(name, numbers))
        if not case.note:
            lines.append(_row("motion", agreement.motion) + " | |")
    lines += [
        "\n## Speed\n\nSimulated over elapsed time, controllers included, nothing recorded, on one"
        " core of a virtual\nmachine with other work on it.\n",
        "| scenario | ours | MuJoCo |",
        "|---|---|---|",
    ]
    for case, agreement in found:
        if not case.note:
            ours, theirs = agreement.real_time_factors
            lines.append(f"| `{case.scenario}` | {ours:.0f} | {theirs:.1f} |")
    return "\n".join(lines) + "\n" + _CAUSES


def _row(name: str, numbers: Iterable[float]) -> str:
    return f"| {name} | " + " | ".join(f"{value:.1e}" for value in numbers) + " |"


if __name__ == "__main__":
    sys.stdout.write(agreement_page([(case, compare(case)) for case in CASES]))
