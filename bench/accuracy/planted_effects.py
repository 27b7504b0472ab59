"""Effects planted one at a time, and what `cspm diagnose` says of each: a table for development.

Most recordings come from the plant whose equations the catalogue shares, so that the table shows
what the method can see, not how it does on a real machine; those from MuJoCo are marked.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

from bench.performance.thesis_machine import SCENARIOS
from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.diagnosis.parameter import Parameter
from cspm_ident.diagnosis.reporting.verdict import verdict_of
from cspm_ident.signals.measurement import read_measurement
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import EffectEntry, load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.library import find_scenario
from cspm_run.recorded_run import run

DURATION_S = 60
FIRST_SEED = 100


@dataclass(frozen=True)
class PlantedCase:
    """What is planted where, and how it is recorded; without load cells if not `cells`."""

    effect: str = ""
    elements: tuple[str, ...] = ()
    parameters: dict[str, float] = field(default_factory=dict)
    plant: str = "sim"
    capture: int = 1000
    cells: bool = True


CASES = (
    PlantedCase(),
    PlantedCase(capture=100),
    PlantedCase(plant="mujoco"),
    PlantedCase("winch_coulomb_friction", ("surge_2",), {"torque": 0.031}),
    PlantedCase("winch_coulomb_friction", ("surge_2",), {"torque": 0.02}, capture=100),
    PlantedCase("winch_coulomb_friction", ("sway_1",), {"torque": 0.01}, plant="mujoco"),
    PlantedCase("winch_viscous_friction", ("hoist_2",), {"coefficient": 2e-5}, plant="mujoco"),
    PlantedCase("winch_torque_gain", ("surge_1",), {"gain": 0.97}),
    PlantedCase("winch_drum_eccentricity", ("sway_2",), {"eccentricity": 2e-4, "phase": 0.5}),
    PlantedCase("tension_gain", ("sway_3",), {"gain": 1.03}),
    PlantedCase("tension_bias", ("hoist_1",), {"bias": 0.3}),
    PlantedCase("cable_stiffness", ("hoist_1",), {"scale": 0.8}),
    PlantedCase("cable_hysteresis", ("surge_1",), {"force": 0.5, "displacement": 0.002}),
    PlantedCase("cable_transverse_damping", (), {"coefficient": 0.5}),
    PlantedCase("pose_delay", ("bar",), {"delay": 0.004}),
    PlantedCase("bar_mass", (), {"mass": 0.1}),
    PlantedCase(cells=False),
    PlantedCase("winch_coulomb_friction", ("surge_2",), {"torque": 0.031}, cells=False),
    PlantedCase("winch_viscous_friction", ("hoist_2",), {"coefficient": 4e-4}, cells=False),
    PlantedCase("winch_torque_gain", ("surge_1",), {"gain": 0.97}, cells=False),
    PlantedCase("winch_drum_radius", ("sway_2",), {"radius": 5e-4}, cells=False),
    PlantedCase("cable_stiffness", ("hoist_1",), {"scale": 0.8}, cells=False),
    PlantedCase("cable_axial_damping", ("surge_1",), {"scale": 0.5}, cells=False),
    PlantedCase("bar_mass", (), {"mass": 0.1}, cells=False),
)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.accuracy.planted_effects", description=__doc__
    )
    parser.add_argument("--only", metavar="EFFECT", help="cases of one effect alone")
    parser.add_argument("--without-cells", action="store_true", help="those without load cells")
    options = parser.parse_args()
    cases = [
        case
        for case in CASES
        if options.only in (None, case.effect) and case.cells is not options.without_cells
    ]
    print("| planted | plant, capture | verdict | found | seconds |\n|---|---|---|---|---:|")
    with ScratchFolder("planted-effects") as folder:
        for case in cases:
            seed = FIRST_SEED + CASES.index(case)
            place = folder / str(seed)
            record(case, seed, place)
            cells = "" if case.cells else ", no load cells"
            row = _planted(case), f"{case.plant}, {case.capture} Hz{cells}", *judge(case, place)
            print(f"| {' | '.join(row)} |", flush=True)


def record(case: PlantedCase, seed: int, folder: Path, duration: float = DURATION_S) -> None:
    """Run the worst sea for `duration` [s] with an effect planted."""
    path = find_scenario("worst_case_steep")
    capture = f"rates.motion_capture={case.capture}"
    scenario = load_scenario(path, [f"duration={duration:g}", f"seed={seed}", capture])
    file = load_testbed(path.parent / scenario.testbed)
    machine = file.testbed
    if case.effect:
        entry = EffectEntry(
            effect=case.effect, elements=case.elements, parameters=dict(case.parameters)
        )
        machine = machine.model_copy(update={"effects": (*machine.effects, entry)})
    bundle = make_bundle(resolve(scenario, machine), file, path.parent)
    run(replace(bundle.concealing(machine), plant=case.plant), folder)


def judge(case: PlantedCase, folder: Path) -> tuple[str, str, str]:
    """Return verdict, what was found, and how long it took, the file without the effect given."""
    begun = time.perf_counter()
    measurement = read_measurement(folder, SCENARIOS / "testbeds" / "thesis.yaml")
    if not case.cells:
        measurement = replace(measurement, tension=None)
    found = diagnose([measurement])
    took = time.perf_counter() - begun
    lines = []
    for finding in found.reported:
        for own in finding.coefficients:
            numbers = ", ".join(map(number_words, finding.parameters_on(own)))
            lines.append(f"{finding.effect} {own.candidate.element}: {numbers}")
        lines += [f"or {rival.words}" for rival in finding.alternatives]
    lines += [f"unknown, {d.place.element}: {d.signal}" for d, *_ in found.unexplained]
    return verdict_of(found).value, "<br>".join(lines), f"{took:.0f}"


def number_words(number: Parameter) -> str:
    """Return a parameter with its interval, if anything bounds it."""
    reported = f"{number.name} {number.value:.4g}"
    return (
        reported if number.ci95 is None else f"{reported} ({number.low:.4g} to {number.high:.4g})"
    )


def _planted(case: PlantedCase) -> str:
    if not case.effect:
        return "nothing"
    values = ", ".join(f"{name} {value:g}" for name, value in case.parameters.items())
    return f"{case.effect} {' '.join(case.elements) or 'all'}: {values}"


if __name__ == "__main__":
    main()
