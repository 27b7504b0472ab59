"""A linear system as its samples show it: inputs held between samples, sensors and torques late."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class SampledSystem:
    """x⁺ = A·x + B·u, y = C·x + D·u, from one sample to the next; u is held in between.

    Attributes:
        A: (s, s).
        B: (s, inputs).
        C: (outputs, s).
        D: (outputs, inputs).
        period: from sample to sample [s].
    """

    A: Array
    B: Array
    C: Array
    D: Array
    period: float

    def response(self, frequencies: ArrayLike) -> ComplexArray:
        """Return G(e^{jωT}), shape (m, outputs, inputs), for ω (m,) [rad/s] up to π/T."""
        z = np.exp(1j * np.atleast_1d(np.asarray(frequencies, dtype=float)) * self.period)
        resolvent = z[:, None, None] * np.eye(len(self.A)) - self.A
        forced = np.linalg.solve(resolvent, np.broadcast_to(self.B, (len(z), *self.B.shape)))
        return np.asarray(self.C @ forced + self.D, dtype=np.complex128)

    def every(self, count: int) -> SampledSystem:
        """Return the same system seen at every `count`-th sample, its input held as long."""
        a, b = np.eye(len(self.A)), np.zeros_like(self.B)
        for _ in range(count):
            a, b = self.A @ a, self.A @ b + self.B
        return replace(self, A=a, B=b, period=count * self.period)

    def late(self, inputs: int, outputs: ArrayLike) -> SampledSystem:
        """Return the system whose inputs act `inputs` samples later.

        And each of whose outputs comes as many samples later as `outputs` (outputs,) says.
        """
        found = self
        for _ in range(inputs):
            found = series(_one_sample(found.B.shape[1], self.period), found)
        waits = np.asarray(outputs)
        for step in range(int(waits.max(initial=0))):
            found = series(found, _one_sample(len(waits), self.period, waits > step))
        return found

    def part(self, outputs: slice, inputs: slice) -> SampledSystem:
        """Return the system from some of its inputs to some of its outputs."""
        return replace(self, B=self.B[:, inputs], C=self.C[outputs], D=self.D[outputs][:, inputs])

    def steps(self, signal: ArrayLike) -> Array:
        """Return the outputs (count, outputs) from rest for inputs (count, inputs)."""
        state, found = np.zeros(len(self.A)), []
        for row in np.asarray(signal, dtype=float):
            found.append(self.C @ state + self.D @ row)
            state = self.A @ state + self.B @ row
        return np.array(found)


def sample(a: Array, b: Array, c: Array, period: float) -> SampledSystem:
    """Return ẋ = A·x + B·u, y = C·x sampled with held inputs."""
    states, inputs = b.shape
    both = np.zeros((states + inputs,) * 2)
    both[:states] = np.hstack([a, b])
    stepped = scipy.linalg.expm(period * both)[:states]
    return SampledSystem(
        stepped[:, :states], stepped[:, states:], c, np.zeros((len(c), inputs)), period
    )


def series(first: SampledSystem, second: SampledSystem) -> SampledSystem:
    """Return `second` with the outputs of `first` as its input."""
    a = scipy.linalg.block_diag(first.A, second.A)
    a[len(first.A) :, : len(first.A)] = second.B @ first.C
    return SampledSystem(
        a,
        np.vstack([first.B, second.B @ first.D]),
        np.hstack([second.D @ first.C, second.C]),
        second.D @ first.D,
        first.period,
    )


def closed(plant: SampledSystem, controller: SampledSystem) -> SampledSystem:
    """Return the loop u = controller·(r − y), from r to y; `plant` has no direct feedthrough."""
    loop = series(controller, plant)
    return replace(loop, A=loop.A - loop.B @ loop.C)


def diagonal(systems: list[SampledSystem]) -> SampledSystem:
    """Return independent systems side by side."""
    a, b, c, d = (
        scipy.linalg.block_diag(*(getattr(each, name) for each in systems)) for name in "ABCD"
    )
    return SampledSystem(a, b, c, d, systems[0].period)


def _one_sample(width: int, period: float, late: NDArray[np.bool_] | None = None) -> SampledSystem:
    """Return y = u of the sample before, where `late`; otherwise y = u."""
    waits = np.eye(width) if late is None else np.diag(late.astype(float))
    zero = np.zeros((width, width))
    return SampledSystem(zero, waits, np.eye(width), np.eye(width) - waits, period)
