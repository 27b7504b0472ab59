"""How often the intervals of `cspm identify system` contain what another plant was given."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from cspm_ident.signals.measurement import Measurement, read_measurement
from cspm_ident.signals.noise import with_more_noise
from cspm_ident.system.choice import choose
from cspm_ident.system.identification import solve
from cspm_ident.system.machine import machine_with
from cspm_msgs_py.new_folder import ScratchFolder
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import Testbed, load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import make_bundle
from cspm_run.recorded_run import run

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
SCENARIO = "factor_six_mid"
# What is recorded, by topic, of what the test-bed file says about its sensor's noise.
_NOISY = {
    "/winch_frame/pose": ("frame_pose", (0, 0, 0, 1, 1, 1)),
    "/bar/pose": ("bar_pose", (0, 0, 0, 1, 1, 1)),
    "/winches/state": ("speed", (1,)),
    "/cables/tension": ("tension", (0,)),
}


class System:
    """A hanging bar, recorded by MuJoCo without noise, noise drawn anew; two windows."""

    names = ("bar.mass", "axial_damping", "bar_damping.surge")
    truth = np.array([4.35, 2.0 / 3.0, 1.5])

    def __init__(self, seconds: float = 9.0) -> None:
        """Record once.

        Args:
            seconds: of the recording that are fitted, from the first move on.
        """
        described = load_testbed(SCENARIOS / "testbeds" / "thesis.yaml")
        machine = described.testbed
        self.chosen = choose(machine, self.names)
        mass, axial, surge = self.truth
        other = machine_with(machine, choose(machine, self.names[::2]), [mass, surge])
        other = _silent(damped(other, axial))
        scenario = load_scenario(SCENARIOS / f"{SCENARIO}.yaml", [f"duration={seconds}"])
        bundle = make_bundle(resolve(scenario, other), described, SCENARIOS).concealing(other)
        with ScratchFolder("coverage") as place:
            folder = place / SCENARIO
            run(replace(bundle, plant="mujoco"), folder)
            self.clean: Measurement = read_measurement(folder).with_testbed(described)

    def intervals(self, rng: np.random.Generator) -> Iterator[tuple[str, np.ndarray]]:
        """Estimate with other noise; intervals of shape (parameters, 2)."""
        sensors, noise = self.clean.machine.sensors, {}
        for topic, (name, kinds) in _NOISY.items():
            sensor = sensors[topic]
            own = np.hypot(np.array(sensor.noise), np.array(sensor.resolution) / np.sqrt(12.0))
            noise[name] = own[list(kinds)]
        noisy = with_more_noise(self.clean, noise, int(rng.integers(2**31)))
        found = solve(
            [noisy], self.chosen, delays={}, seed=int(rng.integers(2**31))
        ).solution.estimate
        yield "output error", found.ci95


def damped(machine: Testbed, factor: float) -> Testbed:
    """Return the machine with all cables' damping times a factor, in the laws themselves."""
    cables = []
    for cable in machine.cables:
        law = cable.damping
        scaled = law.model_copy(update={"factor": factor * law.factor}) if law else None
        cables.append(cable.model_copy(update={"damping": scaled}))
    return machine.model_copy(update={"cables": tuple(cables)})


def _silent(machine: Testbed) -> Testbed:
    """Return the machine with sensors that neither scatter nor round."""
    sensors = {
        topic: sensor.model_copy(
            update={
                "noise": tuple(0.0 for _ in sensor.noise),
                "resolution": tuple(0.0 for _ in sensor.resolution),
            }
        )
        for topic, sensor in machine.sensors.items()
    }
    return machine.model_copy(update={"sensors": sensors})
