"""The thesis's test-bed in the worst case, ready to be stepped in a compiled loop."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cspm_control.waves.build import build_motion
from cspm_model.kernels.cable import RADIUS
from cspm_model.motion import Motion
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import EffectEntry, load_testbed
from cspm_run.assembly import resolve
from cspm_run.bundle import Bundle, make_bundle
from cspm_sim.kernels.plant import make_scratch, plant_advance
from cspm_sim.plant import Plant

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
PERIOD_NS = 1_000_000
# The waves rise during the first 10 s of the scenario; measured is after that.
WAVES_BEGIN_S = 20.0
FRICTION = (
    EffectEntry(effect="winch_coulomb_friction", parameters={"torque": 1e-3}),
    EffectEntry(effect="winch_viscous_friction", parameters={"coefficient": 1e-5}),
)


def worst_case(duration: float) -> Bundle:
    """Return the worst case, resolved, for `duration` [s]."""
    return shipped("worst_case", f"duration={duration}")


def shipped(name: str, *overrides: str) -> Bundle:
    """Return one of the shipped scenarios, resolved."""
    file = SCENARIOS / f"{name}.yaml"
    scenario = load_scenario(file, overrides)
    testbed = load_testbed(file.parent / scenario.testbed)
    return make_bundle(resolve(scenario, testbed.testbed), testbed, file.parent)


def roll_damping() -> tuple[EffectEntry, ...]:
    """Return the effects of the test-bed file."""
    return load_testbed(SCENARIOS / "testbeds" / "thesis.yaml").testbed.effects


class ThesisMachine:
    """The plant with its winch frame in waves and the torques of its first equilibrium held."""

    def __init__(self, effects: Sequence[EffectEntry]) -> None:
        """Place it; the waves are those of the worst case in full height."""
        scenario = load_scenario(SCENARIOS / "worst_case.yaml", [])
        testbed = load_testbed(SCENARIOS / scenario.testbed).testbed
        testbed = testbed.model_copy(update={"effects": tuple(effects)})
        waves = build_motion(
            scenario.winch_frame.motion,
            scenario.winch_frame.mean_pose,
            seed=scenario.seed,
            duration=scenario.duration,
            gravity=testbed.gravity,
            folder=SCENARIOS,
        )
        shift = round(WAVES_BEGIN_S / waves.spacing)
        motion = Motion(np.roll(waves.knots, -shift, axis=0), waves.spacing, waves.periodic)
        self.plant = Plant(testbed, motion, PERIOD_NS, bar_pose=scenario.bar_mean_pose)
        self._torque = self.plant.parameters.cables[:, RADIUS] * self.plant.tensions
        self._start = self.plant.state.copy()
        n = len(testbed.cables)
        self._frames, self._outputs = np.zeros((3, 18)), np.zeros((2, n))
        self._scratch = make_scratch(len(self._start), n)

    def rewind(self) -> None:
        """Go back to the first instant."""
        self.plant.state[:] = self._start

    def advance(self, first: int, steps: int) -> None:
        """Make `steps` steps from step number `first`, in one call of the compiled loop."""
        plant, motion = self.plant, self.plant.frame_motion
        bad = plant_advance(
            plant.state,
            self._torque,
            motion.knots,
            motion.spacing,
            motion.periodic,
            first,
            steps,
            False,
            PERIOD_NS * 1e-9,
            plant.parameters,
            self._frames,
            self._scratch,
            self._outputs,
        )
        if bad >= 0:
            raise RuntimeError(f"diverged: {plant.state_name(bad)}")

    def lowest_tension(self, steps: int) -> float:
        """Return the lowest tension of any cable at any of the first `steps` steps [N]."""
        self.rewind()
        lowest = np.inf
        for step in range(steps):
            self.advance(step, 1)
            lowest = min(lowest, float(self._outputs[0].min()))
        return lowest
