"""How well machines predict a whole recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.block_simulation import BlockSimulation, Input
from cspm_ident.signals.measurement import BAR, Measurement
from cspm_ident.signals.noise_source import noise_of
from cspm_ident.signals.timeline import Timeline
from cspm_ident.system.lateness import delays_to_remove
from cspm_ident.vaf import error_percent, vaf
from cspm_msgs_py.dofs import DOFS
from cspm_msgs_py.testbed import Testbed

Array = NDArray[np.float64]

# Below this many times its noise a coordinate is at rest, and shares of it mean nothing.
_MOVES = 10.0


# Names the identified machine in judgements.
FITTED = "fitted"


@dataclass(frozen=True, eq=False)
class Judgement:
    """A recording beside what machines say of it.

    Attributes:
        measurement: the recording.
        held_out: whether nothing was fitted to it.
        times: of the bar's samples, delays taken out [s], shape (k,).
        measured: the bar's pose there x y z φ θ ψ, shape (k, 6).
        simulated: by machine, the same; NaN where its simulation diverged.
        vaf: by machine, per degree of freedom [%]; None where the bar does not move in it.
        delays: of the sensors, by topic, that were taken out [s].
    """

    measurement: Measurement
    held_out: bool
    times: Array
    measured: Array
    simulated: dict[str, Array]
    vaf: dict[str, dict[str, float | None]]
    delays: dict[str, float]

    def error(self, machine: str) -> float | None:
        """Return the least error of all degrees of freedom [%]; None where the bar is still."""
        shares = [share for share in self.vaf[machine].values() if share is not None]
        return error_percent(max(shares)) if shares else None

    def data(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        path = str(self.measurement.path)
        found = {"vaf_percent": self.vaf, "delays_s": self.delays}
        return {"recording": path, "held_out": self.held_out, **found}


def judge(
    measurement: Measurement,
    machines: Mapping[str, Testbed],
    held_out: bool = False,
    delays: Mapping[str, float] | None = None,
) -> Judgement:
    """Return how well machines predict the bar's pose from the first sample to the last.

    Only motor angles, the frame's pose, the state at the start and one length per cable come from
    the recording: nothing pulls the simulation back.

    Args:
        measurement: the recording.
        machines: by label.
        held_out: whether nothing was fitted to it.
        delays: of the sensors, by topic [s]; None: those found with the first machine.

    Raises:
        InputError: a sensor is missing.
    """
    line = Timeline(measurement)
    if delays is None:
        delays = delays_to_remove(line, next(iter(machines.values())))
    line = line.delayed(delays)
    noise = noise_of(measurement, None)[0][BAR]
    bar = measurement.bar_pose
    late = line.delays.get(BAR, 0.0)
    chosen = bar.shifted(-late).within(line.times[0], line.times[-1]) if bar is not None else None
    times = chosen.times if chosen is not None else np.zeros(0)
    measured = chosen.values if chosen is not None else np.zeros((0, 6))
    simulated, shares = {}, {}
    for label, machine in machines.items():
        simulation = BlockSimulation(line, machine)
        simulation.check(Input.WINCH)
        bars = simulation.run(Input.WINCH, simulation.windows(Input.WINCH, None)).bars
        columns = [np.interp(times, line.times, column) for column in bars.T]
        simulated[label] = np.stack(columns, axis=1)
        shares[label] = _shares(measured, simulated[label], noise)
    return Judgement(measurement, held_out, times, measured, simulated, shares, dict(delays))


def _shares(measured: Array, simulated: Array, noise: Array) -> dict[str, float | None]:
    whole = np.isfinite(simulated).all(axis=1)
    found: dict[str, float | None] = {}
    for i, dof in enumerate(DOFS):
        moves = whole.any() and np.std(measured[:, i]) > _MOVES * noise[i]
        found[dof] = vaf(measured[whole, i], simulated[whole, i]) if moves else None
    return found
