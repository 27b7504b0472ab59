"""Identity of residuals and regressors: places, candidates and their nonlinear parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cspm_sim.effects import Effect
from cspm_sim.effects.effect import Channel, Elements

Array = NDArray[np.float64]


class Place(NamedTuple):
    """One residual.

    Attributes:
        channel: kind of residual.
        element: the cable's name, or `bar`.
    """

    channel: Channel
    element: str


@dataclass(frozen=True)
class Candidate:
    """An effect on one element, with its nonlinear parameters given.

    Attributes:
        effect: of the catalogue.
        element: name of the cable or body.
        shape: the nonlinear parameters, by name, sorted.
        effect_id: the effect's key: its id, and of a table what tells it from others.
    """

    effect: Effect = field(compare=False)
    element: str
    shape: tuple[tuple[str, float], ...] = ()
    effect_id: str = field(init=False)

    def __post_init__(self) -> None:
        """Set the id that represents the effect where candidates are compared."""
        object.__setattr__(self, "effect_id", self.effect.key)

    @property
    def nonlinear(self) -> dict[str, float]:
        """The nonlinear parameters by name."""
        return dict(self.shape)


def shapes_of(effect: Effect) -> Iterator[tuple[tuple[str, float], ...]]:
    """Yield every point of an effect's grid of nonlinear parameters; one empty point if linear."""
    names = sorted(effect.signature.nonlinear)
    for values in product(*(effect.signature.nonlinear[name] for name in names)):
        yield tuple(zip(names, values, strict=True))


def elements_of(effect: Effect, cables: tuple[str, ...], bodies: tuple[str, ...]) -> list[str]:
    """Return the names of the elements that an effect can act on in a machine.

    Args:
        effect: of the catalogue.
        cables: names of the cables.
        bodies: of `bar` and `winch_frame` those that the machine has.
    """
    if effect.acts_on in (Elements.CABLES, Elements.CELLS):
        return list(cables)
    if effect.acts_on is Elements.BODIES:
        return list(bodies)
    return [effect.acts_on.value] if effect.acts_on.value in bodies else []
