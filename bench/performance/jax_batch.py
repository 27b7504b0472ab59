"""A plant step of many variants in JAX's lanes against this project's, one variant at a time.

    python -m bench.performance.jax_batch [--variants 1 8 64 512] [--steps 500]

JAX comes with `pip install jax`. Both make the same Runge-Kutta steps of the same states, the winch
frame at rest and torques held; the last states are compared. Processor time of all threads.
"""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np
from rich.console import Console
from rich.table import Table

from bench.performance.processor_time import spent
from bench.performance.thesis_machine import PERIOD_NS, worst_case
from cspm_model.kernels.cable import RADIUS
from cspm_model.motion import Motion
from cspm_sim.kernels.plant import make_scratch, plant_advance
from cspm_sim.plant import Plant

_SEED, _REPEATS = 7, 5
# Of the bar's speeds [m/s, rad/s], so that variants differ and no cable goes slack.
_SPREAD = 0.01


class PlantVariants:
    """Variants of the thesis's machine at rest, which differ in the bar's speeds."""

    def __init__(self, variants: int) -> None:
        bundle = worst_case(1.0)
        scenario, testbed = bundle.scenario, bundle.testbed.testbed
        testbed = testbed.model_copy(update={"effects": ()})
        self.frame_pose = np.array(scenario.winch_frame.mean_pose)
        still = Motion.still(self.frame_pose)
        self.plant = Plant(testbed, still, PERIOD_NS, bar_pose=scenario.bar_mean_pose)
        self.torque = self.plant.parameters.cables[:, RADIUS] * self.plant.tensions
        rng = np.random.default_rng(_SEED)
        self.states = np.tile(self.plant.state, (variants, 1))
        self.states[:, 6:12] += _SPREAD * rng.standard_normal((variants, 6))

    def advance(self, steps: int) -> np.ndarray:
        """Return the states after so many steps, each variant by itself."""
        plant, motion = self.plant, self.plant.frame_motion
        states = self.states.copy()
        frames, outputs = np.zeros((3, 18)), np.zeros((2, len(self.torque)))
        scratch = make_scratch(states.shape[1], len(self.torque))
        for state in states:
            bad = plant_advance(
                state,
                self.torque,
                motion.knots,
                motion.spacing,
                motion.periodic,
                0,
                steps,
                False,
                PERIOD_NS * 1e-9,
                plant.parameters,
                frames,
                scratch,
                outputs,
            )
            if bad >= 0:
                raise RuntimeError(f"diverged: {plant.state_name(bad)}")
        return states


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m bench.performance.jax_batch",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--variants", type=int, nargs="+", default=[1, 8, 64, 512], metavar="N")
    parser.add_argument("--steps", type=int, default=500)
    options = parser.parse_args()
    table = Table("variants", "this plant [µs]", "JAX [µs]", "ratio", "states differ by")
    for count in options.variants:
        table.add_row(str(count), *measured(count, options.steps))
    Console().print(table)


def measured(variants: int, steps: int) -> tuple[str, str, str, str]:
    """Return processor time of a step of a variant by both, their ratio, and the difference."""
    from bench.performance.jax_plant import make_advance, make_rate

    batch = PlantVariants(variants)
    rate = make_rate(batch.plant.parameters, batch.frame_pose)
    compiled = make_advance(rate, PERIOD_NS * 1e-9, steps)
    torques = np.tile(batch.torque, (variants, 1))

    def in_lanes() -> np.ndarray:
        return np.asarray(compiled(batch.states, torques))

    own = partial(batch.advance, steps)
    difference = np.abs(in_lanes() - own()).max()
    turns = [(spent(own), spent(in_lanes)) for _ in range(_REPEATS)]
    ours, theirs = (1e6 * np.median(each) / steps / variants for each in zip(*turns, strict=True))
    ratio = np.median([b / a for a, b in turns])
    return f"{ours:.2f}", f"{theirs:.2f}", f"{ratio:.2f}", f"{difference:.1e}"


if __name__ == "__main__":
    main()
