"""What an effect declares about itself. One file per effect; nothing else names one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Block(Enum):
    """The part of the plant that an effect changes."""

    WINCH = "winch"
    BAR = "bar"


@dataclass(frozen=True)
class EffectParameter:
    """One number of an effect, with the range in which it is plausible."""

    name: str
    unit: str
    minimum: float
    maximum: float


@dataclass(frozen=True)
class Effect:
    """Physics that can be added to the plant and recognised in a recording.

    Attributes:
        id: the public name.
        block: the block it changes.
        parameters: its numbers, in the kernel's order.
        kernel: `kernel(parameters, signals)`, compiled when used; reads the block's signals and
            adds to them (see `kernels.winch` and `kernels.bar` for their order).
        regressors: from the block's signals over time, shape (samples, signals), what one unit of
            each parameter adds to the block's residual, shape (samples, channels, parameters); a
            winch's residual has one channel, torque against positive motion, the bar's six, the
            wrench. The sum over the parameters is what `kernel` adds.
        equation: the effect in one line.
        shows: how it looks in the block's residual.
        twins: effects it is easily confused with.
        separating_experiment: what tells it from its twins.
        reference: where the equation comes from.
    """

    id: str
    block: Block
    parameters: tuple[EffectParameter, ...]
    kernel: Callable[[Array, Array], None]
    regressors: Callable[[Array], Array]
    equation: str
    shows: str
    twins: tuple[str, ...]
    separating_experiment: str
    reference: str
