"""From raw numbers to SI, and the same said in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cspm_ident.importing.mapping import ChannelSource
from cspm_ident.importing.units import COUNTS, unit_of, units_for
from cspm_ident.importing.unwrapping import Unwrapper
from cspm_msgs_py.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Conversion:
    """SI value = factor · raw + offset, after unwrapping.

    Attributes:
        quantity: the channel's SI unit.
        unit: the column's unit.
        factor: with sign, scale and unit [SI per raw].
        offset: [SI].
        wrap: what the raw number counts to, None if it does not start again.
        invalid: raw values that mean that there is none.
    """

    quantity: str
    unit: str
    factor: float
    offset: float = 0.0
    wrap: float | None = None
    invalid: tuple[int | float, ...] = ()

    @property
    def formula(self) -> str:
        """The conversion in words."""
        text = f"{self.factor:.9g} {self.quantity}/{self.unit} · raw"
        if self.offset:
            text += f" {'+' if self.offset > 0 else '−'} {abs(self.offset):.9g}"
        return text if self.wrap is None else f"{text}, unwrapped at {self.wrap:g}"

    def unwrapper(self) -> Unwrapper | None:
        """Return what makes the raw numbers continuous, None if they are."""
        return None if self.wrap is None else Unwrapper(self.wrap)

    def apply(self, raw: NDArray[Any], unwrapper: Unwrapper | None) -> Array:
        """Return SI values of the next piece of a column, shape (n,), float64 or longdouble.

        Raw values that are `invalid` or infinite become NaN.
        """
        bad = np.isinf(raw)
        for value in self.invalid:
            bad |= raw == raw.dtype.type(value)
        values = np.where(bad, np.nan, raw)
        if unwrapper is not None:
            values = unwrapper.take(values)
        return np.asarray(self.factor * values + self.offset, dtype=np.float64)


def conversion_of(source: ChannelSource, quantity: str, where: str) -> Conversion:
    """Return the conversion of a column to a channel with this SI unit.

    Raises:
        InputError: the unit is unknown, or of another quantity and no scale says how many.
    """
    name = source.unit or quantity
    unit = unit_of(name, f"{where}.unit")
    factor = unit.factor
    held = unit.quantity
    if source.unit == COUNTS and source.counts_per_turn is not None:
        held, factor = "rad", 2.0 * np.pi / source.counts_per_turn
    if held != quantity and source.scale is None:
        how = " with counts_per_turn," if name == COUNTS and quantity == "rad" else ""
        raise InputError(
            f"{where}.unit: '{name}' is no {quantity}, allowed:{how}"
            f" {', '.join(units_for(quantity))}, or a scale in {quantity} per {held}"
        )
    scale = 1.0 if source.scale is None else source.scale
    return Conversion(
        quantity, name, source.sign * scale * factor, source.offset, source.wrap, source.invalid
    )
