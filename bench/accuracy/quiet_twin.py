"""Whether a machine is stable that shakes or errs: its run without sensors' noise, for longer."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import cspm
from bench.accuracy.drawn_machine import PERIOD, DrawnMachine
from bench.accuracy.judged_run import moving

Array = NDArray[np.float64]

# By so much the largest error of the second turn exceeds that of the first where it grows; the
# first has the start in it.
ERROR_GROWS = 1.2


def instabilities(drawn: DrawnMachine, folder: Path) -> tuple[str, ...]:
    """Return in words what grows, or keeps moving, though no sensor is noisy; stable: nothing.

    Args:
        drawn: the machine.
        folder: a new one, for its files.
    """
    folder.mkdir()
    run = cspm.simulate(_quiet(drawn).save(folder), duration=2.0 * PERIOD)
    failed = [run.failure] if run.failure else []
    grows = _grows(np.asarray(run.bar_pose.values), np.asarray(run.bar_reference.values))
    return (*failed, *moving(run.tension.time, run.tension.values), *grows)


def _quiet(drawn: DrawnMachine) -> DrawnMachine:
    sensors = {
        topic: {**sensor, "noise": (np.zeros_like(sensor["noise"], dtype=float)).tolist()}
        for topic, sensor in drawn.testbed["sensors"].items()
    }
    return drawn._replace(testbed={**drawn.testbed, "sensors": sensors})


def _grows(poses: Array, references: Array) -> Iterator[str]:
    """Yield that the distance between poses (k, 6) and references (m, 6) is more, the second turn.

    Both cover the same two turns, by other instants.
    """
    largest = []
    for turn in (0, 1):
        at = np.linspace(0.5 * turn, 0.5 * turn + 0.499, 500)
        pose = poses[(at * len(poses)).astype(int)]
        reference = references[(at * len(references)).astype(int)]
        largest.append(np.linalg.norm((pose - reference)[:, :3], axis=1).max())
    if largest[1] > ERROR_GROWS * largest[0]:
        yield f"the error grows from {largest[0]:.3g} m to {largest[1]:.3g} m a turn later"
