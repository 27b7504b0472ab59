"""Where the cables can hold the bar at rest: the static workspace, thesis section 6-2-2."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cspm_control.analysis.cable_structure import CableStructure, wanted_at_rest
from cspm_control.analysis.pose_grid import Grid
from cspm_control.analysis.workspace_kernels import general_holds, pseudo_inverse_holds

Mask = NDArray[np.bool_]

ALGORITHMS = ("pseudo_inverse", "general")
# Poses that a thread does before it looks whether it should go on.
CHUNK = 50_000


def static_workspace(
    machine: CableStructure,
    grid: Grid,
    algorithm: str,
    advance: Callable[[int], None] = lambda _: None,
    stopped: Callable[[], bool] = lambda: False,
) -> Mask:
    """Return at which poses of a grid the cables hold the bar, as booleans of the grid's shape.

    Tensions are between 0 and each cable's highest, as in the thesis.

    Args:
        machine: the machine.
        grid: the poses.
        algorithm: one of `ALGORITHMS`.
        advance: called with how many more poses are done.
        stopped: says whether to give up; what is not done then counts as not held.
    """
    kernel: Callable[..., None] = pseudo_inverse_holds
    extra: tuple[NDArray[np.int64], ...] = ()
    if algorithm == "general":
        kernel, extra = general_holds, (_bases(machine),)
    out = np.zeros(grid.size, dtype=np.bool_)
    fixed = (
        *(*machine.bodies(grid), machine.cables, np.array(machine.axes)),
        wanted_at_rest(machine, grid),
    )
    work = partial(_chunk, kernel, (*fixed, machine.limits[:, 1].copy(), *extra, out))
    with ThreadPoolExecutor(_workers()) as threads:
        for done in threads.map(partial(work, stopped), range(0, grid.size, CHUNK)):
            advance(done)
    return out.reshape(grid.shape)


def _chunk(
    kernel: Callable[..., None],
    arguments: tuple[object, ...],
    stopped: Callable[[], bool],
    first: int,
) -> int:
    out = arguments[-1]
    assert isinstance(out, np.ndarray)
    last = min(first + CHUNK, len(out))
    if not stopped():
        kernel(first, last, *arguments)
    return last - first


def _workers() -> int:
    return len(os.sched_getaffinity(0))


def _bases(machine: CableStructure) -> NDArray[np.int64]:
    return np.array(list(combinations(range(len(machine.cables)), len(machine.axes))))
