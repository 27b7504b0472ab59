"""What `cspm identify system` finds of a machine that another plant simulated.

`python -m bench.accuracy.recovery` records scenario factor_six_mid on the MuJoCo plant with wrong
numbers throughout, identifies them, and writes the table of results/identification.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console

from bench.accuracy.system_coverage import damped
from bench.page import into_page
from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_ident.system.choice import choose
from cspm_ident.system.identification import SystemResult, identify_system
from cspm_ident.system.machine import machine_with
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import Testbed, TestbedFile, load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.recorded_run import run

ROOT = Path(__file__).resolve().parents[2]
SCENARIOS = ROOT / "scenarios"
PAGE = ROOT / "results" / "identification.md"
TESTBED = SCENARIOS / "testbeds" / "thesis.yaml"
SCENARIO = "factor_six_mid"
# What the recorded machine has; factors count from the described one.
TRUTH = {
    "bar.mass": 4.35,
    "bar.com.x": 0.012,
    "bar.inertia": 1.08,
    "stiffness": 0.9,
    "axial_damping": 2.0 / 3.0,
    "bar_damping.surge": 1.5,
    "bar_damping.roll": 0.011,
}
_LAWS = ("stiffness", "axial_damping")


def main() -> None:
    """Run the whole."""
    console = Console()
    described = load_testbed(TESTBED)
    console.print(f"recording {SCENARIO}")
    measurement = record(described, _recorded(described.testbed))
    chosen = choose(described.testbed, list(TRUTH))
    result = identify_system([measurement], chosen, progress=console.print)
    text = "\n\n".join([found_table(result, TRUTH), _vaf_table(result)])
    console.print(text, markup=False, highlight=False)
    into_page(PAGE, "recovery", text)


def record(described: TestbedFile, machine: Testbed) -> Measurement:
    """Return the scenario on the MuJoCo plant of a machine, said to be the described one."""
    scenario = resolve(load_scenario(SCENARIOS / f"{SCENARIO}.yaml"), described.testbed)
    bundle = make_bundle(scenario, described, SCENARIOS).concealing(machine)
    with ScratchFolder("recovery") as place:
        folder = place / SCENARIO
        run(replace(bundle, plant="mujoco"), folder)
        return read_measurement(folder).with_testbed(described)


def _recorded(machine: Testbed) -> Testbed:
    """Return the machine with the other numbers, those of cables in their laws."""
    names = [name for name in TRUTH if name not in _LAWS]
    other = machine_with(machine, choose(machine, names), [TRUTH[name] for name in names])
    other = damped(other, TRUTH["axial_damping"])
    scale, cables = TRUTH["stiffness"], []
    for cable in other.cables:
        law = cable.stiffness
        numbers = {key: scale * getattr(law, key) for key in ("a", "youngs_modulus")}
        cables.append(cable.model_copy(update={"stiffness": law.model_copy(update=numbers)}))
    return other.model_copy(update={"cables": tuple(cables)})


def found_table(result: SystemResult, truth: Mapping[str, float]) -> str:
    """Return what was found beside the truth, by name, as a table of a page."""
    estimate = result.solution.estimate
    rows = ["| | described | put in | found, 95 % interval | |", "|---|---|---|---|---|"]
    for each in result.chosen:
        low, high = estimate.interval(each.name)
        true, value = truth[each.name], estimate.value(each.name)
        unit = "" if each.parameter.unit == "1" else f", {each.parameter.unit}"
        held = "holds" if low <= true <= high else "**misses**"
        found = f"{value:.5f} ({low:.5f} … {high:.5f})"
        if not np.isfinite(high - low):
            held, found = "", "not excited"
        rows.append(f"| `{each.name}`{unit} | {each.nominal:g} | {true:.5g} | {found} | {held} |")
    return "\n".join(rows)


def _vaf_table(result: SystemResult) -> str:
    rows = [f"| VAF, % | {' | '.join(DOFS)} |", "|---" * (1 + len(DOFS)) + "|"]
    for label, shares in result.judgements[0].vaf.items():
        cells = ("still" if share is None else f"{share:.3f}" for share in shares.values())
        rows.append(f"| {label} | {' | '.join(cells)} |")
    return "\n".join(rows)


if __name__ == "__main__":
    main()
